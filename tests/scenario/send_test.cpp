// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <set>
#include <thread>

#include "machine/stream/journal.h"
#include "scenario/driver.h"
#include "scenario/mill.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

class Send : public Scenario {
 protected:
  void SetUp() override { write(at("job.ngc"), zig_zag(20)); }

  /// send job.ngc and more.
  Arguments send(const Arguments& more) const {
    Arguments arguments = {"send", path("job.ngc"), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  [[nodiscard]] JournalRecord journal() const { return read_journal(at("job.ngc.journal")); }
};

TEST_F(Send, RunsAJobOnTheSimulatedControllers) {
  write(at("job.ngc"), "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX50 F600\nG0 Z5\nM5\nM2\n");
  for (const char* port : {"sim:", "sim:grbl", "sim:grblhal"}) {
    for (const bool counting : {false, true}) {
      Arguments arguments = send({"--port", port, "--json"});
      if (counting) arguments.emplace_back("--character-counting");
      const Outcome outcome = run(arguments);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(outcome.json()["status"], "done");
      EXPECT_EQ(outcome.json()["result"]["executed"], 8);
      EXPECT_TRUE(journal().finished);
    }
  }
}

TEST_F(Send, LetsTheControllerCheckEveryLine) {
  write(at("job.ngc"), "G21 G90\nS12000 M3\nG0 X10 Y10\nG1 X50 F600\nM5\nM2\n");
  const Outcome outcome = run(send({"--port", "sim:grbl", "--dry-run", "--json"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["checked_lines"], 6);
  EXPECT_FALSE(fs::exists(at("job.ngc.journal")));
}

TEST_F(Send, ADryRunSaysWhatIsAmissInAProgram) {
  write(at("job.ngc"), "(\xC3\xBC)\nT1\nG21 G90\nS12000 M3\nG0 X10 Y10\nG1 X50 F600\nG2 I5\n");
  const std::vector<std::string> words = {"ends with the spindle on", "no end",
                                          "line 1 has a comment", "line 7 has a circle"};
  const Outcome text = run({"send", path("job.ngc"), "--dry-run"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  const Outcome json = run(send({"--dry-run", "--json"}));
  for (const std::string& word : words) {
    EXPECT_THAT(text.err, HasSubstr("warning: "));
    EXPECT_THAT(text.err, HasSubstr(word));
    EXPECT_THAT(json.json()["warnings"].dump(), HasSubstr(word));
  }
}

TEST_F(Send, RefusesWhatTheMachineCannotDo) {
  write(at("job.ngc"), "G21 G90\nS90000 M3\nG0 X900\nM5\nM2\n");
  expect_refusal(run(send({"--port", "sim:grbl"})), 2, {"S90000", "$30=24000", "moves X", "$130"});
}

TEST_F(Send, RefusesPortsAndOptionsThatAreNone) {
  expect_refusal(run(send({})), 2, {"--port"});
  expect_refusal(run(send({"--port", "COM3"})), 2, {"--port", "COM3"});
  expect_refusal(run(send({"--port", "/dev/no-such-port"})), 2, {"/dev/no-such-port"});
  expect_refusal(run(send({"--port", "tcp:127.0.0.1:1"})), 2, {"tcp:127.0.0.1:1"});
  expect_refusal(run(send({"--port", "sim:fluidnc"})), 2, {"fluidnc"});
  expect_refusal(run(send({"--port", "sim:", "--resume"})), 2, {"no journal"});
  expect_refusal(run(send({"--port", "sim:", "--resume", "--restart"})), 2, {"--restart"});
  expect_refusal(run(send({"--port", "sim:", "--spindle", "h100"})), 2, {"--spindle"});
  expect_refusal(run(send({"--port", "/dev/null", "--spindle", "huanyang"})), 2, {"Modbus"});
}

/// Every numbered line of the zig-zag was cut to its end.
void expect_whole(Mill& mill, int rows) {
  std::set<std::int64_t> done;
  for (const ExecutedPiece& piece : mill.pieces()) {
    if (!piece.rapid && piece.complete) done.insert(piece.number);
  }
  for (std::int64_t line = 8; line < 8 + 21 * rows; ++line) EXPECT_EQ(done.count(line), 1U) << line;
}

TEST_F(Send, RunsAJobThroughASerialPort) {
  Mill mill;
  const Outcome outcome = run(send({"--port", mill.path(), "--home", "--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  EXPECT_EQ(outcome.json()["status"], "done");
  expect_whole(mill, 20);
}

TEST_F(Send, GoesOnAfterSigkill) {
  Mill mill(4.0);
  {
    Process process(send({"--port", mill.path(), "--home"}));
    ASSERT_TRUE(mill.cut(100));
    while (process.runs_for(std::chrono::milliseconds(50)) && journal().last.executed < 60) {
    }
    process.send(SIGKILL);
    process.wait();
  }
  EXPECT_EQ(journal().status, "");
  expect_refusal(run(send({"--port", mill.path()})), 2, {"--resume", "--restart"});
  expect_refusal(run(send({"--port", mill.path(), "--resume"})), 2, {"--yes"});
  const Outcome outcome = run(send({"--port", mill.path(), "--resume", "--yes", "--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  EXPECT_GT(outcome.json()["resumed"]["line"], 8);
  expect_whole(mill, 20);
}

TEST_F(Send, AnInterruptHoldsResetsAndCanBeResumed) {
  Mill mill;
  Process process(send({"--port", mill.path(), "--home", "--json"}));
  ASSERT_TRUE(mill.cut(100));
  process.send(SIGINT);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_EQ(outcome.json()["status"], "interrupted");
  EXPECT_EQ(outcome.json()["result"]["at_rest"], true);
  const std::size_t cut = mill.pieces().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(mill.pieces().size(), cut) << "nothing moves after the reset";
  EXPECT_EQ(run(send({"--port", mill.path(), "--resume", "--yes"})).exit_code, 0);
  expect_whole(mill, 20);
}

TEST_F(Send, AnotherProgramIsNotResumed) {
  Mill mill;
  {
    Process process(send({"--port", mill.path(), "--home"}));
    ASSERT_TRUE(mill.cut(50));
    process.send(SIGKILL);
    process.wait();
  }
  write(at("job.ngc"), zig_zag(21));
  expect_refusal(run(send({"--port", mill.path(), "--resume", "--yes"})), 2,
                 {"job.ngc.journal", "another program"});
}

TEST_F(Send, OneSenderHasAPort) {
  Mill mill;
  Process process(send({"--port", mill.path(), "--home"}));
  ASSERT_TRUE(mill.cut(20));
  expect_refusal(run(send({"--port", mill.path(), "--journal", path("other")})), 2,
                 {"another sender"});
}

TEST_F(Send, AFullDiskForTheJournalHoldsTheMachine) {
  Mill mill;
  Process process(send({"--port", mill.path(), "--home"}), 1500);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("File too large"));
  EXPECT_THAT(outcome.out, HasSubstr("stands still"));
  EXPECT_EQ(run(send({"--port", mill.path(), "--resume", "--yes"})).exit_code, 0);
  expect_whole(mill, 20);
}

}  // namespace
}  // namespace lensforge::scenario
