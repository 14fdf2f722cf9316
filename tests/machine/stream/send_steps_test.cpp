// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/send_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SendSteps : public ::testing::Test {
 protected:
  ControllerInfo info = grbl();
  SenderOptions options;
  SendRules rules{info, options, false};
  LineTracker tracker{{}};

  static ControllerInfo grbl() {
    ControllerInfo info;
    info.dialect = grbl_dialect();
    info.rx_bytes = 128;
    info.planner_blocks = 15;
    return info;
  }
  static OutgoingLine line(const std::string& text, std::int64_t number = 1) {
    OutgoingLine line;
    line.text = text;
    line.line = number;
    return line;
  }
  static OutgoingLine spindle_on() {
    OutgoingLine on = line("S1000M3");
    on.barrier = true;
    on.spindle = SpindleOrder{SpindleTurn::kClockwise, 1000.0};
    return on;
  }
  static StatusReport report(const std::string& text) { return *parse_status_report(text); }
  SendStep reported(SendState state, const std::string& text, double now = 1.0) const {
    return send_step::reported(std::move(state), report(text), rules, now);
  }
};

TEST_F(SendSteps, NothingLeavesInAHoldOrBeforeTheGuardHasReadAll) {
  SendState state;
  EXPECT_TRUE(send_step::may_send(state, rules));
  EXPECT_FALSE(send_step::may_send(state, {info, options, true}));
  state.guard.ready = true;
  EXPECT_TRUE(send_step::may_send(state, {info, options, true}));
  state.hold.held = true;
  EXPECT_FALSE(send_step::may_send(state, rules));
}

TEST_F(SendSteps, LinesFillTheBufferOnlyWhenCharactersAreCounted) {
  EXPECT_TRUE(send_step::has_room(line("G1X1"), tracker, rules, false));
  EXPECT_FALSE(send_step::has_room(line("G1X1"), tracker, rules, true)) << "the link is behind";
  tracker.send(line(std::string(100, 'X')), 0.0);
  EXPECT_FALSE(send_step::has_room(line("G1X1"), tracker, rules, false));
  options.character_counting = true;
  EXPECT_TRUE(send_step::has_room(line(std::string(26, 'X')), tracker, rules, false));
  EXPECT_FALSE(send_step::has_room(line(std::string(27, 'X')), tracker, rules, false));
  OutgoingLine alone = line("G54");
  alone.alone = true;
  EXPECT_FALSE(send_step::has_room(alone, tracker, rules, false));
}

TEST_F(SendSteps, ACutNeedsAVerifiedSpindle) {
  OutgoingLine cut = line("G1X1F100", 7);
  cut.cuts = true;
  SendState state;
  EXPECT_THAT(send_step::cut_fault(state, cut, rules)->what(), HasSubstr("line 7 moves at feed"));
  state.spindle.order = {SpindleTurn::kClockwise, 1000.0};
  EXPECT_FALSE(send_step::cut_fault(state, cut, rules));
  state.spindle.verified = false;
  EXPECT_TRUE(send_step::cut_fault(state, cut, rules));
  cut.cuts = false;
  EXPECT_FALSE(send_step::cut_fault(state, cut, rules));
}

TEST_F(SendSteps, ACutNeedsNoSpindleThatIsSwitchedByHand) {
  OutgoingLine cut = line("G1X1F100", 7);
  cut.cuts = true;
  info.dialect.spindle_by_hand = true;
  SendState state;
  EXPECT_FALSE(send_step::cut_fault(state, cut, rules));
  state.spindle.order = {SpindleTurn::kClockwise, 1000.0};
  state.spindle.verified = false;
  EXPECT_TRUE(send_step::cut_fault(state, cut, rules)) << "the program starts it all the same";
}

TEST_F(SendSteps, ASpindleOrderIsABarrierThatWaitsForItsAnswerAndTheSpeed) {
  SendState state = send_step::handed_over({}, spindle_on(), true, 3.0);
  EXPECT_EQ(state.phase, SendPhase::kAnswer);
  EXPECT_FALSE(state.spindle.verified);
  EXPECT_EQ(state.progress_at, 3.0);
  state = send_step::acknowledged(state, true, 4.0);
  EXPECT_EQ(state.phase, SendPhase::kSpindle);
  EXPECT_EQ(state.spindle.since, 4.0);
  state = reported(state, "<Idle|MPos:0.000,0.000,0.000|FS:0,400>").state;
  SendStep step = send_step::verify_spindle(state, rules, 5.0);
  EXPECT_EQ(step.state.phase, SendPhase::kSpindle);
  EXPECT_FALSE(step.fault);
  EXPECT_THAT(send_step::verify_spindle(state, rules, 100.0).fault->what(),
              HasSubstr("did not come to 1000 rpm in time"));
  state = reported(state, "<Idle|MPos:0.000,0.000,0.000|FS:0,1000>").state;
  step = send_step::verify_spindle(state, rules, 5.0);
  EXPECT_EQ(step.state.phase, SendPhase::kStreaming);
  EXPECT_TRUE(step.state.spindle.verified);
}

TEST_F(SendSteps, TheLastAnswerEndsTheJob) {
  OutgoingLine end = line("M2");
  end.barrier = end.ends = true;
  const SendState state = send_step::handed_over({}, end, true, 0.0);
  EXPECT_EQ(send_step::acknowledged(state, false, 1.0).phase, SendPhase::kAnswer);
  EXPECT_EQ(send_step::acknowledged(state, true, 1.0).phase, SendPhase::kEnding);
}

TEST_F(SendSteps, IdleCountsWhenItWasAskedForAfterTheLastLine) {
  SendState state = send_step::handed_over({}, line("G0X1"), true, 0.0);
  state = reported(state, "<Idle|MPos:0.000,0.000,0.000|FS:0,0>").state;
  state = send_step::count_idle(state, info);
  EXPECT_EQ(state.status.idle_reports, 0) << "asked for before the line left";
  state = send_step::count_idle(state, info);
  EXPECT_FALSE(send_step::drained(state, tracker));
  state = send_step::count_idle(state, info);
  EXPECT_TRUE(send_step::drained(state, tracker));
  state.status.report.room = BufferRoom{14, 128};
  EXPECT_EQ(send_step::count_idle(state, info).status.idle_reports, 0) << "a block is planned";
}

TEST_F(SendSteps, AQuestionIsAskedAgainAndThenGivenUp) {
  send_step::Question asked = send_step::ask_status({}, options, 10.0);
  EXPECT_TRUE(asked.ask);
  EXPECT_FALSE(send_step::ask_status(asked.state, options, 10.1).ask) << "five a second";
  asked = send_step::ask_status(asked.state, options, 10.2);
  EXPECT_TRUE(asked.ask);
  EXPECT_EQ(asked.state.status.asked_since, 10.0);
  EXPECT_THAT(send_step::ask_status(asked.state, options, 14.0).fault->what(),
              HasSubstr("has not answered ? for 4 s"));
  const SendStep answered = reported(asked.state, "<Idle|MPos:0.000,0.000,0.000|FS:0,0>");
  EXPECT_FALSE(answered.state.status.asked_since);
}

TEST_F(SendSteps, AHoldFromOutsideIsToldOnceAndHasItsLimit) {
  options.hold_limit = 10.0;
  SendStep step = reported({}, "<Hold:0|MPos:0.000,0.000,0.000|FS:0,0>", 1.0);
  EXPECT_TRUE(step.state.hold.held);
  EXPECT_THAT(step.notes, ElementsAre("held from outside"));
  step = reported(step.state, "<Hold:0|MPos:0.000,0.000,0.000|FS:0,0>", 2.0);
  EXPECT_THAT(step.notes, IsEmpty());
  EXPECT_THAT(reported(step.state, "<Hold:0|MPos:0.000,0.000,0.000|FS:0,0>", 12.0).fault->what(),
              HasSubstr("held for longer"));
  step = reported(step.state, "<Run|MPos:0.000,0.000,0.000|FS:0,0>", 4.0);
  EXPECT_FALSE(step.state.hold.held);
  EXPECT_THAT(step.notes, ElementsAre("goes on after a hold of 3 s"));
}

TEST_F(SendSteps, APauseOfTheProgramIsNoHold) {
  OutgoingLine pause = line("M0");
  pause.barrier = pause.pauses = true;
  const SendState state = send_step::handed_over({}, pause, true, 0.0);
  const SendStep step = reported(state, "<Hold:0|MPos:0.000,0.000,0.000|FS:0,0>");
  EXPECT_FALSE(step.state.hold.held);
  EXPECT_FALSE(step.fault);
}

TEST_F(SendSteps, StatesThatNobodyAskedForStopTheJob) {
  const std::pair<const char*, StopCause> cases[] = {{"Alarm", StopCause::kAlarm},
                                                     {"Door:1", StopCause::kDoor},
                                                     {"Jog", StopCause::kUnexpectedState},
                                                     {"Tool", StopCause::kUnexpectedState},
                                                     {"Check", StopCause::kUnexpectedState}};
  for (const auto& [name, cause] : cases) {
    const SendStep step = reported({}, "<" + std::string(name) + "|MPos:0.000,0.000,0.000|FS:0,0>");
    ASSERT_TRUE(step.fault) << name;
    EXPECT_EQ(cause_name(step.fault->cause()), cause_name(cause)) << name;
  }
}

TEST_F(SendSteps, OverridesAreToldWhereTheyChangeAndKeptWhereTheyAreNotReported) {
  SendStep step = reported({}, "<Run|MPos:0.000,0.000,0.000|FS:0,0|Ov:110,100,100>");
  EXPECT_THAT(step.notes, ElementsAre("overrides: feed 110 %, rapids 100 %, spindle 100 %"));
  step = reported(step.state, "<Run|MPos:0.000,0.000,0.000|FS:0,0>");
  EXPECT_THAT(step.notes, IsEmpty());
  EXPECT_EQ(step.state.status.report.overrides->x(), 110);
}

TEST_F(SendSteps, OnlyMotionAndAnswersPostponeAStall) {
  tracker.send(line("G1X1", 5), 0.0);
  SendState state;
  state.progress_at = 10.0;
  EXPECT_FALSE(send_step::watch_for_stall(state, tracker, options, 15.0).fault);
  EXPECT_THAT(send_step::watch_for_stall(state, tracker, options, 15.1).fault->what(),
              HasSubstr("the controller is idle, but line 5 was never answered"));
  state.status.report.state = ReportedState::kRun;
  EXPECT_THAT(send_step::watch_for_stall(state, tracker, options, 15.1).fault->what(),
              HasSubstr("no motion, and no answer to line 5"));
  state.hold.held = true;
  EXPECT_EQ(send_step::watch_for_stall(state, tracker, options, 99.0).state.progress_at, 99.0);
}

TEST_F(SendSteps, ASpindleThatLosesItsSpeedStopsTheJob) {
  SendState state;
  state.guard.report.interlocks_ok = true;
  state.guard.report.spindle = SpindleState::kChanging;
  state.guard.report.rpm = 400.0;
  EXPECT_FALSE(send_step::guarded(state, options, 1.0).fault) << "nothing is asked of it";
  state.spindle.order = {SpindleTurn::kClockwise, 1000.0};
  EXPECT_THAT(send_step::guarded(state, options, 1.0).fault->what(),
              HasSubstr("the spindle lost its speed"));
  state.guard.report.interlocks_ok = false;
  state.guard.report.reason = "door open";
  state.guard.ready = true;
  EXPECT_EQ(std::string(send_step::guarded(state, options, 1.0).fault->what()), "door open");
}

TEST_F(SendSteps, RepliesThatAnswerNothingStopTheJob) {
  const auto cause_of = [](const std::string& text) {
    const SendStep step = send_step::other_reply({}, parse_reply(text), 3);
    return step.fault ? std::string(step.fault->what()) : std::string();
  };
  EXPECT_THAT(cause_of("error:20"), HasSubstr("line 3 was refused"));
  EXPECT_THAT(cause_of("Grbl 1.1h ['$' for help]"), HasSubstr("started afresh"));
  EXPECT_THAT(cause_of("okk"), HasSubstr("not a reply to anything: 'okk'"));
  EXPECT_EQ(cause_of(""), "");
  EXPECT_EQ(cause_of("[echo: G1X1]"), "");
  EXPECT_THAT(send_step::other_reply({}, parse_reply("[MSG:Pgm End]"), 3).notes,
              ElementsAre("controller: Pgm End"));
}

}  // namespace
}  // namespace lensforge
