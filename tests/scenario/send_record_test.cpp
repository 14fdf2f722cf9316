// SPDX-License-Identifier: GPL-3.0-or-later
#include <sstream>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class SendRecord : public Scenario {
 protected:
  void SetUp() override {
    std::string program = "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\n";
    for (int x = 11; x <= 56; ++x) program.append("X").append(std::to_string(x)).append("\n");
    write(at("job.ngc"), program.append("M5\nM2\n"));
  }
  [[nodiscard]] Arguments send(const Arguments& more) const {
    Arguments arguments = {"send", path("job.ngc"), "--quiet", "--port", "sim:"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(SendRecord, EventsAreJsonObjectsOnTheirOwn) {
  const Outcome outcome = run(send({"--json", "--events", path("events")}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["status"], "done") << "one result on standard output";
  std::istringstream lines(content(at("events")));
  std::vector<std::string> kinds;
  std::int64_t farthest = 0;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json event = nlohmann::json::parse(line);
    for (const char* key : {"time", "state", "line", "position", "rpm", "sha256", "left"}) {
      EXPECT_TRUE(event.contains(key)) << key << " in " << line;
    }
    EXPECT_GE(event["line"], farthest);
    farthest = event["line"];
    kinds.push_back(event["event"]);
  }
  ASSERT_GT(kinds.size(), 20U);
  EXPECT_EQ(kinds.front(), "begin");
  EXPECT_EQ(kinds[1], "status");
  EXPECT_EQ(kinds.back(), "end");
  EXPECT_EQ(farthest, 52);
}

TEST_F(SendRecord, EventsLeaveStandardOutputToTheResult) {
  expect_refusal(run(send({"--events", "-", "--events", "-"})), 2, {"--events"});
  const Outcome outcome = run(send({"--json", "--events", "-"}));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--events -"));
  expect_refusal(run(send({"--events", path("no/such/folder")})), 2,
                 {"--events", "no/such/folder"});
}

TEST_F(SendRecord, TheLogTellsTheWholeStory) {
  write(at("job.ngc.log"), "2026-11-22T10:00:00.000Z  lensforge 0.1.0 send earlier\n");
  ASSERT_EQ(run(send({})).exit_code, 0);
  const std::string log = content(at("job.ngc.log"));
  for (const char* part :
       {"send earlier\n", "lensforge 0.", "program job.ngc, ", "sha256 ",
        "controller grbl, Grbl 1.1", "settings $", " $30=24000", "pre-flight: passed", "line ",
        " of 0 rpm", "end: done: the program came to its end", "carried out up to line 52"}) {
    EXPECT_THAT(log, HasSubstr(part));
  }
  std::istringstream lines(log);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    EXPECT_THAT(line, MatchesRegex("[0-9-]+T[0-9:]+\\.[0-9][0-9][0-9]Z  .+"));
  }
}

TEST_F(SendRecord, TheLogTellsWhyNothingWasSent) {
  write(at("job.ngc"), "G21 G90\nS90000 M3\nG0 X1\nM5\nM2\n");
  EXPECT_EQ(run(send({"--log", path("log")})).exit_code, 2);
  EXPECT_THAT(content(at("log")), HasSubstr("pre-flight: refused: line 2 asks for S90000"));
  EXPECT_FALSE(fs::exists(at("job.ngc.log")));
}

TEST_F(SendRecord, AFullDiskForLogAndEventsStopsNothing) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  Arguments arguments = send({"--log", "/dev/full", "--events", "/dev/full", "--json"});
  std::erase(arguments, "--quiet");
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["status"], "done");
  EXPECT_THAT(outcome.err, HasSubstr("warning: the log stops here: /dev/full"));
  EXPECT_THAT(outcome.err, HasSubstr("warning: the events end here: /dev/full"));
}

}  // namespace
}  // namespace lensforge::scenario
