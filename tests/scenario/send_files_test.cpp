// SPDX-License-Identifier: GPL-3.0-or-later
// What `send` reads and writes: regular files of its own, and none in the place of another.
#include <sys/stat.h>

#include <csignal>

#include "machine/stream/journal.h"
#include "scenario/driver.h"
#include "scenario/mill.h"
#include "scenario/terminal_process.h"
#include "scenario/wire_tap.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kProgram =
    "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX50 F600\nG0 Z5\nM5\nM2\n";

class SendFiles : public Scenario {
 protected:
  void SetUp() override { write(at("job.ngc"), kProgram); }

  [[nodiscard]] Outcome send(const Arguments& more) const {
    Arguments arguments = {"send", path("job.ngc"), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
};

TEST_F(SendFiles, AreNeverMadeOfWhatIsSomebodyElses) {
  for (const auto& [option, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"--journal", "G21 G90\nG0 X1 Y2\nM2\n"},
           {"--log", "2026-11-22 10:00:00 lensforge 1\n"},
           {"--log", "\n"},
           {"--events", "{\"event\": \"begin\", \"time\": 7}\n"}}) {
    write(at("other"), bytes);
    expect_refusal(send({"--port", "sim:", option, path("other"), "--restart"}), 2,
                   {"other: exists"});
    EXPECT_EQ(content(at("other")), bytes);
  }
}

TEST_F(SendFiles, ThatAreRefusedDoNotSpoilTheLog) {
  write(at("other"), "notes\n");
  expect_refusal(send({"--port", "sim:", "--events", path("other")}), 2, {"other: exists"});
  const Outcome outcome = run({"send", path("job.ngc"), "--port", "sim:"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("no log")));
  EXPECT_THAT(content(at("job.ngc.log")), HasSubstr("end: done"));
}

TEST_F(SendFiles, BesideAProgramAreLeftAloneWhereTheyAreSomebodyElses) {
  write(at("job.ngc.log"), "my notes\n");
  const Outcome outcome = run({"send", path("job.ngc"), "--port", "sim:"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("warning: no log: "));
  EXPECT_EQ(content(at("job.ngc.log")), "my notes\n");
  write(at("job.ngc.journal"), "my notes\n");
  expect_refusal(send({"--port", "sim:", "--restart"}), 2, {"job.ngc.journal", "--journal"});
  EXPECT_EQ(content(at("job.ngc.journal")), "my notes\n");
}

TEST_F(SendFiles, GoOnInTheirOwn) {
  const Arguments own = {"--port", "sim:",    "--journal", path("a"),
                         "--log",  path("b"), "--events",  path("c")};
  EXPECT_EQ(send(own).exit_code, 0);
  const std::size_t log = content(at("b")).size();
  const std::size_t events = content(at("c")).size();
  const Outcome again = send(own);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_GT(content(at("b")).size(), log + log / 2);
  EXPECT_GT(content(at("c")).size(), events + events / 2);
}

TEST_F(SendFiles, AreNeverOneAnother) {
  fs::create_hard_link(at("job.ngc"), at("hard"));
  fs::create_symlink("job.ngc", at("soft"));
  fs::create_symlink("new", at("nowhere"));
  const std::vector<Arguments> clashes = {
      {"--log", path("job.ngc")},
      {"--journal", path("hard")},
      {"--events", path("soft")},
      {"--log", path("new"), "--events", path("./new")},
      {"--journal", path("nowhere"), "--events", path("new")},
      {"--events", path("job.ngc.journal")},
      {"--journal", path("job.ngc.log")},
  };
  for (const Arguments& clash : clashes) {
    Arguments arguments = {"--port", "sim:"};
    arguments.insert(arguments.end(), clash.begin(), clash.end());
    expect_refusal(send(arguments), 2, {clash[0], "is the same as"});
    EXPECT_EQ(content(at("job.ngc")), kProgram);
    EXPECT_FALSE(fs::exists(at("new")));
  }
}

TEST_F(SendFiles, AreNoPorts) {
  Mill mill;
  expect_refusal(send({"--port", mill.path(), "--log", mill.path()}), 2, {"is the same as"});
  expect_refusal(send({"--port", "sim:", "--log", mill.path()}), 2, {"serial port"});
  expect_refusal(send({"--port", "sim:", "--journal", mill.path()}), 2, {"device"});
  expect_refusal(send({"--port", mill.path(), "--spindle", "yl620@" + mill.path()}), 2,
                 {"--spindle", "is the same as"});
  expect_refusal(send({"--port", "tcp:127.0.0.1:502", "--spindle", "generic_plc@127.0.0.1:502"}), 2,
                 {"Modbus device PLC"});
  EXPECT_TRUE(mill.pieces().empty());
}

TEST_F(SendFiles, ThatAreReadAreRegular) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  write(at("file"), "");
  expect_refusal(run({"send", path("pipe"), "--dry-run"}), 2, {"pipe: is a named pipe"});
  expect_refusal(run({"info", path("pipe")}), 2, {"pipe"});
  for (const char* more : {"--restart", "--resume"}) {
    expect_refusal(send({"--port", "sim:", "--journal", path("pipe"), more}), 2, {"named pipe"});
  }
  expect_refusal(send({"--port", "/dev/null", "--spindle", path("pipe")}), 2, {"pipe"});
  expect_refusal(send({"--port", path("pipe")}), 2, {"no serial port"});
  expect_refusal(send({"--port", path("file")}), 2, {"no serial port"});
  EXPECT_FALSE(fs::exists(at("pipe.log")));
}

TEST_F(SendFiles, WithoutMotionAreNoPrograms) {
  write(at("job.ngc"), "");
  expect_refusal(send({"--port", "sim:"}), 2, {"job.ngc: is empty"});
  expect_refusal(send({"--dry-run"}), 2, {"job.ngc: is empty"});
  EXPECT_FALSE(fs::exists(at("job.ngc.journal")));
  EXPECT_THAT(run({"info", path("job.ngc")}).out, HasSubstr("moves nothing"));
}

TEST_F(SendFiles, ThatChangeWhileTheyAreCutStopTheMachine) {
  // Comments first, so that what is read later than at once begins some rows into the cut.
  constexpr int kComments = 320;
  std::string program;
  for (int i = 0; i < kComments; ++i) program += "(" + std::string(197, '.') + ")\n";
  program += zig_zag(20);
  write(at("job.ngc"), program);
  Mill mill(8.0);
  Process process({"send", path("job.ngc"), "--quiet", "--port", mill.path(), "--home", "--json"});
  ASSERT_TRUE(mill.cut(5));
  std::string changed = program;
  for (std::size_t at = 0; (at = changed.find("\nG1 Y-", at)) != std::string::npos; ++at) {
    changed[at + 4] = 'X';
  }
  write(at("job.ngc"), changed);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.json()["result"]["reason"].get<std::string>(),
              HasSubstr("job.ngc: was changed on the disk"));
  EXPECT_EQ(outcome.json()["result"]["at_rest"], true);
  for (const ExecutedPiece& piece : mill.pieces()) {
    if (piece.number <= kComments + 8) continue;
    ASSERT_LT(piece.end.x(), -189.9) << piece.number;
  }
}

TEST_F(SendFiles, WithControlBytesInTheirNamesLeaveTheTerminalAlone) {
  const std::string name = "a\x1b]0;owned\x07\x1b[2J.ngc";
  fs::rename(at("job.ngc"), at(name));
  const std::vector<Arguments> commands = {
      {"send", path(name), "--port", "sim:"},
      {"send", path("none\x1b[2J"), "--dry-run"},
      {"send", path(name), "--port", "tcp:\x1b[2J:1"},
      {"send", path(name), "--port", "/dev/null", "--spindle", "\x1b[2J"},
      {"info", path(name)},
  };
  for (const Arguments& command : commands) {
    const Outcome outcome = run(command);
    EXPECT_THAT(outcome.out + outcome.err, Not(HasSubstr("\x1b"))) << outcome.exit_code;
    EXPECT_THAT(outcome.out + outcome.err, Not(HasSubstr("\x07")));
  }
  EXPECT_THAT(content(at(name + ".log")), Not(HasSubstr("\x1b")));
}

TEST_F(SendFiles, AnInterruptStopsHoming) {
  Mill mill(1.0);
  WireTap tap(mill.path());
  Process process({"send", path("job.ngc"), "--port", tap.path(), "--home"});
  ASSERT_TRUE(tap.sends("$H\n"));
  process.send(SIGTERM);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_THAT(outcome.err, HasSubstr("while homing: the controller was reset"));
  EXPECT_TRUE(tap.sends("\x18", "$H\n"));
}

TEST_F(SendFiles, AnInterruptEndsTheQuestion) {
  write(at("job.ngc"), zig_zag(8));
  Mill mill;
  {
    Process process({"send", path("job.ngc"), "--quiet", "--port", mill.path(), "--home"});
    ASSERT_TRUE(mill.cut(50));
    process.send(SIGINT);
    process.wait();
  }
  TerminalProcess process({"send", path("job.ngc"), "--port", mill.path(), "--resume"});
  ASSERT_TRUE(process.shows("Go on?"));
  process.send(SIGTERM);
  EXPECT_EQ(process.wait(), 130);
}

}  // namespace
}  // namespace lensforge::scenario
