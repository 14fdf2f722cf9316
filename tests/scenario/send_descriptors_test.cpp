// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing that is printed reaches a controller, a journal, a log or a program, whichever of the
// standard descriptors is closed or leads there.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "machine/gcode/program_seal.h"
#include "machine/stream/journal.h"
#include "scenario/driver.h"
#include "scenario/mill.h"
#include "scenario/wire_tap.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

/// Runs the command in a shell. @param redirections  as the shell writes them. @return exit code.
int run_in_shell(const Arguments& arguments, const std::string& redirections) {
  std::string line = std::string("exec '") + LENSFORGE_COMMAND + "'";
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  const int status = std::system((line + " " + redirections).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

class SendDescriptors : public Scenario {
 protected:
  void SetUp() override { write(at("job.ngc"), zig_zag(2)); }

  [[nodiscard]] Arguments send(const std::string& port) const {
    return {"send", path("job.ngc"), "--port", port, "--home"};
  }

  void expect_records() const {
    EXPECT_TRUE(read_journal(at("job.ngc.journal")).finished);
    EXPECT_EQ(read_journal(at("job.ngc.journal")).torn, 0);
    std::istringstream lines(content(at("job.ngc.log")));
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) {
      EXPECT_THAT(line, MatchesRegex("[0-9-]+T[0-9:]+\\.[0-9][0-9][0-9]Z  .+"));
    }
    EXPECT_GT(count, 5);
  }
};

TEST_F(SendDescriptors, ThatAreClosedSendTheDisplayNowhere) {
  Mill mill(60.0);
  WireTap tap(mill.path());
  for (const char* closed : {"<&- >&- 2>&-", ">&- 2>&-", "2>&-"}) {
    fs::remove(at("job.ngc.journal"));
    fs::remove(at("job.ngc.log"));
    const bool loses_result = std::string(closed).find(">&- ") != std::string::npos;
    const std::string rest = loses_result ? "" : std::string(" >") + path("out");
    EXPECT_EQ(run_in_shell(send(tap.path()), closed + rest), loses_result ? 1 : 0) << closed;
    expect_records();
  }
  const std::string sent = tap.sent();
  EXPECT_THAT(sent, HasSubstr("G1X-199.5"));
  const std::size_t foreign =
      sent.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-$#?\n\x18");
  EXPECT_EQ(foreign, std::string::npos) << sent.substr(foreign, 200);
}

TEST_F(SendDescriptors, MustNotLeadToThePort) {
  Mill mill;
  WireTap tap(mill.path());
  EXPECT_EQ(run_in_shell(send(tap.path()), ">" + tap.path() + " 2>" + path("said")), 2);
  EXPECT_THAT(content(at("said")), HasSubstr("is where standard output goes"));
  EXPECT_EQ(run_in_shell(send(tap.path()), ">" + tap.path() + " 2>&1"), 2);
  EXPECT_EQ(tap.sent(), "") << "not even the message";
  EXPECT_FALSE(fs::exists(at("job.ngc.journal")));
}

TEST_F(SendDescriptors, MustNotLeadToTheFilesOfTheJob) {
  for (const char* file : {"job.ngc.journal", "job.ngc.log"}) {
    EXPECT_EQ(run_in_shell(send("sim:"), ">>" + path(file) + " 2>" + path("said")), 2) << file;
    EXPECT_EQ(content(at(file)), "");
    EXPECT_THAT(content(at("said")), HasSubstr(file));
  }
}

TEST_F(SendDescriptors, ThatNobodyReadsKeepNoMachineWaiting) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const Descriptor pipe(::open(path("pipe").c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  while (::write(pipe.number(), "x", 1) == 1) {
  }
  Mill mill(20.0);
  EXPECT_EQ(run_in_shell(send(mill.path()), ">" + path("out") + " 2>" + path("pipe")), 0);
  EXPECT_TRUE(read_journal(at("job.ngc.journal")).finished);
}

TEST_F(SendDescriptors, ThatAreClosedLeaveProgramsOfCamWhole) {
  ASSERT_NO_FATAL_FAILURE(place_small_lens(at("lens")));
  const Arguments cam = {"cam", path("lens"), "--pitch",    "2mm",         "--tool-diameter",
                         "4mm", "--no-semi",  "--no-rough", "--no-render", "--threads",
                         "2"};
  run_in_shell(cam, "<&- >&- 2>&-");
  ASSERT_TRUE(fs::exists(at("lens/cam/finish.ngc")));
  EXPECT_EQ(check_seal(at("lens/cam/finish.ngc")), true);
}

}  // namespace
}  // namespace lensforge::scenario
