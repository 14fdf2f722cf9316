// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "core/full_disk.h"
#include "core/temp_folder.h"
#include "machine/fast_controller.h"
#include "machine/guard/guard.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_feed.h"

namespace lensforge::sender_test {
namespace {

using ::testing::ElementsAre;
using testing::FastController;
using ::testing::HasSubstr;

const char* const kProgram =
    "(a job)\n"
    "G21 G90 G17 G94\n"
    "\n"
    "G0 Z5\n"
    "S12000 M3\n"
    "G4 P1\n"
    "G0 X1 Y2\n"
    "G1 Z-0.5 F150 (plunge)\n"
    "X2 F500\n"
    "x3 ; lower case\n"
    "G0 Z5\n"
    "M5\n"
    "M2\n";

/// A spindle that obeys at once, and fails when it is told to.
class FakeGuard : public Guard {
 public:
  double rpm = 0.0;
  bool lame = false;  ///< Never comes to speed.
  GuardReport trouble;
  bool troubled = false;
  std::vector<std::string> orders;

  void spin(double asked, bool clockwise) override {
    rpm = asked;
    orders.push_back((clockwise ? "cw " : "ccw ") + std::to_string(static_cast<int>(asked)));
  }
  void stop() override {
    rpm = 0.0;
    orders.emplace_back("stop");
  }
  GuardReport poll() override {
    if (troubled) return trouble;
    GuardReport report;
    report.rpm = rpm;
    report.spindle = rpm <= 0.0 ? SpindleState::kStopped
                     : lame     ? SpindleState::kChanging
                                : SpindleState::kAtSpeed;
    return report;
  }
};

class SenderTest : public ::testing::Test {
 protected:
  FastController controller;
  SenderOptions options;
  SendControl control;
  std::stop_source stop;
  std::stop_source reset;
  Guard* guard = nullptr;
  Journal* journal = nullptr;

  /// Runs `program` from the handshake to the end.
  SendResult send(const std::string& program) {
    Wire wire(controller);
    Dialogue dialogue(wire, controller, {});
    const ControllerInfo info = learn_controller(dialogue, dialogue.reset());
    controller.lines.clear();
    controller.urgent.clear();
    controller.received = 0;
    std::istringstream text(program);
    ProgramFeed feed(text, {info.dialect, info.line_numbers, {}, 1, 0, {}});
    control.stop = stop.get_token();
    control.reset = reset.get_token();
    Sender sender({wire, controller, guard, journal}, info, options, 1);
    return sender.run(feed, control);
  }

  /// Answers to the line that begins with `text` in another way.
  void answer_to(const std::string& text, const std::string& reply) {
    controller.answer = [=](const std::string& line, std::int64_t) {
      return line.find(text) != std::string::npos ? reply : "ok\r\n";
    };
  }

  void expect_held(const SendResult& result, StopCause cause, const std::string& reason) {
    EXPECT_EQ(result.status, SendStatus::kFault);
    EXPECT_EQ(cause_name(result.cause), cause_name(cause));
    EXPECT_THAT(result.reason, HasSubstr(reason));
    EXPECT_TRUE(result.at_rest);
    EXPECT_THAT(controller.urgent, ElementsAre("!"));
  }
};

TEST_F(SenderTest, LearnsTheControllerFromItsAnswers) {
  Wire wire(controller);
  Dialogue dialogue(wire, controller, {});
  EXPECT_EQ(dialogue.status().state, ReportedState::kIdle);
  const ControllerInfo info = learn_controller(dialogue, dialogue.reset());
  EXPECT_EQ(info.dialect.name, "grbl");
  EXPECT_TRUE(info.line_numbers);
  EXPECT_EQ(info.rx_bytes, 128);
  EXPECT_EQ(info.planner_blocks, 15);
  EXPECT_EQ(info.setting(30), 24000.0);
  EXPECT_EQ(info.start.origins[0], Eigen::Vector3d(10.0, 20.0, -30.0));
  EXPECT_EQ(info.start.position, Eigen::Vector3d::Zero());
}

TEST_F(SenderTest, SendsEveryLineOnceCompactedAndNumbered) {
  const SendResult result = send(kProgram);
  EXPECT_TRUE(result.done()) << result.reason;
  EXPECT_THAT(controller.lines,
              ElementsAre("N2G21G90G17G94", "N4G0Z5", "N5S12000M3", "N6G4P1", "N7G0X1Y2",
                          "N8G1Z-0.5F150", "N9X2F500", "N10X3", "N11G0Z5", "N12M5", "N13M2"));
  EXPECT_EQ(result.acknowledged, 13);
  EXPECT_EQ(result.executed, 13);
  EXPECT_TRUE(controller.urgent.empty());
}

TEST_F(SenderTest, AsksForStatusFiveTimesASecondAtMost) {
  controller.per_line = 0.01;
  std::string program = "G21\nS1000 M3\nF100\n";
  for (int i = 0; i < 2000; ++i) program += "G1 X" + std::to_string(i) + "\n";
  const SendResult result = send(program);
  EXPECT_TRUE(result.done()) << result.reason;
  EXPECT_LE(static_cast<double>(controller.status_asked), 5.0 * controller.now() + 2.0);
  EXPECT_GE(static_cast<double>(controller.status_asked), 4.0 * result.seconds);
}

TEST_F(SenderTest, SendResponseHasOneLineOnItsWay) {
  std::int64_t answered = 0;
  std::int64_t most = 0;
  controller.answer = [&](const std::string&, std::int64_t number) {
    most = std::max(most, number - answered);
    return std::string();
  };
  // What is answered, is so only with the next report.
  control.watch = [&](const SendEvent&) {
    if (answered == controller.received) return;
    ++answered;
    controller.say("ok\r\n");
  };
  EXPECT_TRUE(send(kProgram).done());
  EXPECT_EQ(most, 1);
}

TEST_F(SenderTest, CharacterCountingNeverOverfillsTheBuffer) {
  options.character_counting = true;
  std::size_t held = 0;
  std::size_t most = 0;
  // Lines stay unanswered until the next status report is asked for.
  std::string program = "G21 G90\nS1000 M3\n";
  for (int i = 0; i < 500; ++i) program += "G1 X" + std::to_string(i) + ".25 Y1.5 F100\n";
  std::vector<std::size_t> pending;
  controller.answer = [&](const std::string& line, std::int64_t) {
    if (line.find('X') == std::string::npos) return std::string("ok\r\n");
    held += line.size() + 1;
    most = std::max(most, held);
    pending.push_back(line.size() + 1);
    controller.bytes = 128 - static_cast<int>(held);
    if (pending.size() < 5) return std::string();
    std::string oks;
    for (std::size_t i = 0; i < pending.size(); ++i) oks += "ok\r\n";
    pending.clear();
    held = 0;
    controller.bytes = 128;
    return oks;
  };
  send(program);
  EXPECT_LE(most, 128U);
  EXPECT_GT(most, 90U) << "the buffer is to be used";
}

TEST_F(SenderTest, PartialWritesLoseNothing) {
  controller.most_bytes = 3;
  EXPECT_TRUE(send(kProgram).done());
  EXPECT_EQ(controller.lines.size(), 11U);
  EXPECT_EQ(controller.lines.back(), "N13M2");
}

TEST_F(SenderTest, AnErrorHoldsAndNamesTheLine) {
  answer_to("X2F500", "error:22\r\n");
  const SendResult result = send(kProgram);
  expect_held(result, StopCause::kError, "line 9");
  EXPECT_THAT(result.reason, HasSubstr("no feed"));
  EXPECT_EQ(result.acknowledged, 8);
  EXPECT_LE(result.executed, 8);
  EXPECT_EQ(controller.lines.back(), "N9X2F500") << "nothing is sent after the fault";
}

TEST_F(SenderTest, EveryOtherBadReplyHoldsToo) {
  const std::vector<std::tuple<std::string, StopCause, std::string>> cases = {
      {"ALARM:1\r\n", StopCause::kAlarm, "limit switch"},
      {"o\x7fk\r\n", StopCause::kGarbledReply, "not a reply"},
      {"ok\r\nok\r\n", StopCause::kCountMismatch, "no line waits"},
      {"\r\nGrbl 1.1h ['$' for help]\r\n", StopCause::kReset, "started afresh"},
      {"", StopCause::kCountMismatch, "never answered"},
      {"<Door:1|MPos:0,0,0>\r\n", StopCause::kDoor, "door"},
      {"<Alarm|MPos:0,0,0>\r\n", StopCause::kAlarm, "alarm"},
      {"<Sleep|MPos:0,0,0>\r\n", StopCause::kUnexpectedState, "Sleep"},
      {"$30=1000\r\n", StopCause::kGarbledReply, "not a reply"}};
  for (const auto& [reply, cause, reason] : cases) {
    controller = FastController();
    answer_to("M5", reply);  // A barrier: what comes after it waits for the answer.
    const SendResult result = send(kProgram);
    expect_held(result, cause, reason);
    EXPECT_EQ(controller.lines.back(), "N12M5") << reply;
  }
}

TEST_F(SenderTest, SilenceIsAStall) {
  struct Mute : FastController {
    bool mute = false;
    std::string read(double wait) override {
      std::string said = FastController::read(wait);
      return mute ? std::string() : said;
    }
  } mute;
  Wire wire(mute);
  Dialogue dialogue(wire, mute, {});
  const ControllerInfo info = learn_controller(dialogue, dialogue.reset());
  mute.mute = true;
  std::istringstream text(kProgram);
  ProgramFeed feed(text, {info.dialect, true, {}, 1, 0, {}});
  Sender sender({wire, mute}, info, options, 1);
  const SendResult result = sender.run(feed, control);
  EXPECT_EQ(result.cause, StopCause::kStall);
  EXPECT_FALSE(result.at_rest);
}

TEST_F(SenderTest, NothingCutsBeforeTheSpindleIsVerified) {
  FakeGuard lame;
  lame.lame = true;
  guard = &lame;
  const SendResult result = send(kProgram);
  expect_held(result, StopCause::kSpindle, "12000 rpm in time");
  EXPECT_EQ(controller.lines.back(), "N5S12000M3");
  EXPECT_THAT(lame.orders, ElementsAre("cw 12000")) << "a spindle that turns is left turning";
}

TEST_F(SenderTest, AClampedSpeedIsNotTheSpeedAskedFor) {
  controller.answer = [&](const std::string& line, std::int64_t) {
    if (line.find("M3") != std::string::npos) controller.spindle = 1000.0;  // $30
    return std::string("ok\r\n");
  };
  expect_held(send(kProgram), StopCause::kSpindle, "12000 rpm in time");
}

TEST_F(SenderTest, CutsWithoutASpindleAreRefused) {
  const SendResult result = send("G21 G90\nG1 X1 F100\n");
  expect_held(result, StopCause::kSpindle, "line 2");
  EXPECT_THAT(controller.lines, ElementsAre("N1G21G90"));
}

TEST_F(SenderTest, DrivesTheSpindleThroughItsGuard) {
  FakeGuard spindle;
  guard = &spindle;
  EXPECT_TRUE(send(kProgram).done());
  ASSERT_FALSE(spindle.orders.empty());
  EXPECT_EQ(spindle.orders.front(), "cw 12000");
  EXPECT_EQ(spindle.orders[1], "stop");
}

TEST_F(SenderTest, TroubleAtTheGuardHolds) {
  for (const bool interlock : {true, false}) {
    controller = FastController();
    FakeGuard spindle;
    guard = &spindle;
    spindle.trouble.interlocks_ok = !interlock;
    spindle.trouble.spindle = SpindleState::kFailed;
    spindle.trouble.reason = "PLC: vacuum is 0";
    controller.per_line = 0.1;
    controller.answer = [&](const std::string& line, std::int64_t) {
      spindle.troubled = spindle.troubled || line.find("X2") != std::string::npos;
      return std::string("ok\r\n");
    };
    expect_held(send(kProgram), interlock ? StopCause::kInterlock : StopCause::kSpindle, "vacuum");
    EXPECT_THAT(spindle.orders, ElementsAre("cw 12000"));
    EXPECT_EQ(controller.lines.back().substr(0, 3), "N9X");
  }
}

TEST_F(SenderTest, AStopRequestHoldsThenResets) {
  controller.answer = [&](const std::string& line, std::int64_t) {
    if (line.find("X2") != std::string::npos) stop.request_stop();
    return std::string("ok\r\n");
  };
  const SendResult result = send(kProgram);
  EXPECT_EQ(result.status, SendStatus::kInterrupted);
  EXPECT_TRUE(result.at_rest);
  EXPECT_THAT(controller.urgent, ElementsAre("!", "reset"));
  EXPECT_EQ(controller.lines.back(), "N9X2F500");
}

TEST_F(SenderTest, AStopRequestStopsASpindleThatIsDrivenFromHere) {
  FakeGuard spindle;
  guard = &spindle;
  controller.answer = [&](const std::string& line, std::int64_t) {
    if (line.find("X2") != std::string::npos) stop.request_stop();
    return std::string("ok\r\n");
  };
  EXPECT_EQ(send(kProgram).status, SendStatus::kInterrupted);
  EXPECT_THAT(spindle.orders, ElementsAre("cw 12000", "stop"));
}

TEST_F(SenderTest, ASecondStopRequestResetsAtOnce) {
  controller.hold_from_idle = false;  // Never comes to rest.
  controller.answer = [&](const std::string& line, std::int64_t) {
    if (line.find("X2") != std::string::npos) {
      controller.state = "Hold:1";
      stop.request_stop();
      reset.request_stop();
    }
    return std::string("ok\r\n");
  };
  const SendResult result = send(kProgram);
  EXPECT_EQ(result.status, SendStatus::kInterrupted);
  EXPECT_EQ(controller.urgent.back(), "reset");
  EXPECT_LT(result.seconds, 5.0);
}

TEST_F(SenderTest, AHoldFromOutsideIsWaitedOut) {
  int reports = 0;
  control.watch = [&](const SendEvent& event) {
    if (event.acknowledged == 9 && reports++ == 0) controller.state = "Hold:0";
    if (reports > 0 && event.report.state == ReportedState::kHold && ++reports == 20) {
      controller.state = "Idle";
    }
  };
  controller.per_line = 0.3;
  EXPECT_TRUE(send(kProgram).done());
  EXPECT_GE(reports, 20);
  EXPECT_EQ(controller.lines.size(), 11U);
}

TEST_F(SenderTest, AHoldBeyondTheLimitEndsTheJob) {
  options.hold_limit = 30.0;
  controller.per_line = 0.3;
  control.watch = [&](const SendEvent& event) {
    if (event.acknowledged == 9) controller.state = "Hold:0";
  };
  expect_held(send(kProgram), StopCause::kHeld, "longer than allowed");
}

TEST_F(SenderTest, TheOperatorsKeysBecomeRealtimeBytes) {
  std::vector<OperatorKey> keys = {OperatorKey::kHold, OperatorKey::kResume};
  controller.per_line = 0.01;
  double pressed = 0.0;
  control.keys = [&]() -> std::optional<OperatorKey> {
    if (keys.empty() || controller.now() < pressed + 2.0) return std::nullopt;
    const OperatorKey key = keys.front();
    keys.erase(keys.begin());
    pressed = controller.now();
    return key;
  };
  EXPECT_TRUE(send(kProgram).done());
  EXPECT_THAT(controller.urgent, ElementsAre("!", "~"));
}

TEST_F(SenderTest, WithoutLineNumbersTheBoundOfWhatIsDoneIsThePlanner) {
  std::string program = "G21 G90\nS1000 M3\nF100\n";
  for (int i = 0; i < 200; ++i) program += "G1 X" + std::to_string(i) + "\n";
  answer_to("X150", "error:2\r\n");
  controller.per_line = 0.1;
  const SendResult result = send(program);
  // 15 planned, one more, and ten cut into steps; then two seconds. X150 stands in line 154.
  EXPECT_EQ(result.acknowledged, 153);
  EXPECT_LE(result.executed, 153 - 26 - 20 + 2);
  EXPECT_GE(result.executed, 153 - 26 - 20 - 4);
}

TEST_F(SenderTest, AFullDiskForTheJournalHolds) {
  const testing::TempFolder folder;
  const auto kept =
      Journal::create(folder / "job.journal", {std::string(64, 'a'), 100000, "a"}, {});
  journal = kept.get();
  controller.per_line = 1.0;
  std::string program = "G21 G90\nS1000 M3\nF100\n";
  for (int i = 0; i < 2000; ++i) program += "G1 X" + std::to_string(i) + "\n";
  const testing::FullDisk full(16384);
  const SendResult result = send(program);
  expect_held(result, StopCause::kJournal, "File too large");
  EXPECT_LT(controller.lines.size(), 2000U);
}

TEST_F(SenderTest, NonsenseOfAnyBytesHoldsAndIsKept) {
  const testing::TempFolder folder;
  const JobIdentity job{std::string(64, 'a'), 100000, "a"};
  const auto kept = Journal::create(folder / "job.journal", job, {});
  journal = kept.get();
  answer_to("X2F500", std::string(1000, '\x1b') + "\r\n");
  const SendResult result = send(kProgram);
  expect_held(result, StopCause::kGarbledReply, "not a reply to anything: '???");
  EXPECT_EQ(result.reason.find('\x1b'), std::string::npos);
  EXPECT_THAT(read_journal(folder / "job.journal").reason, HasSubstr("anything: '???"));
}

TEST_F(SenderTest, TheJournalKnowsHowItEnded) {
  const testing::TempFolder folder;
  {
    const auto kept =
        Journal::create(folder / "job.journal", {std::string(64, 'a'), 100000, "a"}, {});
    journal = kept.get();
    answer_to("X2F500", "error:22\r\n");
    send(kProgram);
  }
  const JournalRecord record = read_journal(folder / "job.journal");
  EXPECT_EQ(record.status, "fault");
  EXPECT_THAT(record.reason, HasSubstr("line 9"));
  EXPECT_EQ(record.last.sent, 9);
  EXPECT_EQ(record.last.acknowledged, 8);
  EXPECT_EQ(record.last.state, "Hold");
}

TEST_F(SenderTest, SpindleAndCutInOneLineIsRefused) {
  expect_held(send("G21 G90\nG1 X1 F100 S1000 M3\n"), StopCause::kProgram, "line 2");
}

}  // namespace
}  // namespace lensforge::sender_test
