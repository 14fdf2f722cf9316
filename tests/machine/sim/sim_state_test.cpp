// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>

#include "machine/sim/sim_firmware.h"

namespace lensforge {
namespace {

using sim_state::Door;
using sim_state::Due;
using sim_state::Start;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr SimMotion kNone{};
constexpr SimMotion kRunning{false, false, false};
constexpr SimMotion kSlowing{false, true, false};
constexpr SimMotion kHeld{false, true, true};

SimState in(MachineState state) {
  SimState now;
  now.state = state;
  return now;
}

TEST(SimState, AHoldIsDueOnceItHasComeToItsStand) {
  const SimState held = sim_state::stopping(in(MachineState::kRun), MachineState::kHold, true);
  EXPECT_TRUE(sim_state::moving(held, kSlowing));
  EXPECT_TRUE(sim_state::suspended(held));
  EXPECT_EQ(sim_state::text(held, false, 0.0), "Hold:1");
  EXPECT_EQ(sim_state::due(held, kSlowing, 0.0), Due::kNothing);
  EXPECT_EQ(sim_state::due(held, kHeld, 0.0), Due::kStopped);
  EXPECT_EQ(sim_state::on_cycle_start(held), Start::kNothing) << "it still slows down";
  SimState stopped = held;
  stopped.stopped = true;
  EXPECT_EQ(sim_state::on_cycle_start(stopped), Start::kResume);
  EXPECT_EQ(sim_state::resumed(stopped, kHeld).state, MachineState::kRun);
  EXPECT_EQ(sim_state::resumed(stopped, kNone).state, MachineState::kIdle);
}

TEST(SimState, AHoldAtAStandStopsAtOnce) {
  EXPECT_TRUE(sim_state::stopping(in(MachineState::kIdle), MachineState::kHold, false).stopped);
}

TEST(SimState, ADoorRestoresTheSpindleBeforeItGoesOn) {
  SimState door = in(MachineState::kDoor);
  door.door_open = true;
  EXPECT_EQ(sim_state::text(door, false, 0.0), "Door:1");
  EXPECT_EQ(sim_state::on_cycle_start(door), Start::kNothing);
  door.door_open = false;
  EXPECT_EQ(sim_state::on_cycle_start(door), Start::kRestoreSpindle);
  door.restoring_until = 4.0;
  EXPECT_EQ(sim_state::text(door, false, 1.0), "Door:3");
  EXPECT_EQ(sim_state::on_cycle_start(door), Start::kNothing);
  EXPECT_EQ(sim_state::due(door, kHeld, 3.9), Due::kNothing);
  EXPECT_EQ(sim_state::due(door, kHeld, 4.0), Due::kRestored);
  EXPECT_EQ(sim_state::resumed(door, kHeld).restoring_until, SimState::kNever);
}

TEST(SimState, WhatADoorMeansDependsOnWhatIsDone) {
  EXPECT_EQ(sim_state::on_door(in(MachineState::kHome)), Door::kAlarm);
  EXPECT_EQ(sim_state::on_door(in(MachineState::kCheck)), Door::kNothing);
  EXPECT_EQ(sim_state::on_door(in(MachineState::kRun)), Door::kStop);
}

TEST(SimState, OnlyAResetInMotionLosesThePosition) {
  EXPECT_EQ(sim_state::alarm_of_reset(in(MachineState::kIdle)), 0);
  EXPECT_EQ(sim_state::alarm_of_reset(in(MachineState::kHold)), 0);
  EXPECT_EQ(sim_state::alarm_of_reset(in(MachineState::kRun)), 3);
  EXPECT_EQ(sim_state::alarm_of_reset(in(MachineState::kHome)), 6);
}

TEST(SimState, LimitsLockAndAlarmsOutliveAReset) {
  const SimState limit = sim_state::alarmed(in(MachineState::kRun), 2);
  EXPECT_TRUE(limit.critical);
  EXPECT_TRUE(sim_state::suspended(limit));
  EXPECT_FALSE(sim_state::alarmed(in(MachineState::kRun), 3).critical);
  const SimState reset = sim_state::restarted(limit);
  EXPECT_EQ(reset.state, MachineState::kAlarm);
  EXPECT_FALSE(reset.critical);
  EXPECT_EQ(sim_state::text(reset, true, 0.0), "Alarm:2");
  EXPECT_EQ(sim_state::text(reset, false, 0.0), "Alarm");
  EXPECT_EQ(sim_state::restarted(in(MachineState::kSleep)).state, MachineState::kAlarm);
  EXPECT_EQ(sim_state::restarted(in(MachineState::kCheck)).state, MachineState::kIdle);
  EXPECT_EQ(sim_state::homed(reset).alarm, 0);
}

TEST(SimState, MotionEndsWhereItsLineSaid) {
  EXPECT_EQ(sim_state::due(in(MachineState::kRun), kRunning, 0.0), Due::kNothing);
  EXPECT_EQ(sim_state::due(in(MachineState::kRun), kNone, 0.0), Due::kRanOut);
  SimState tool = in(MachineState::kJog);
  EXPECT_EQ(sim_state::ran_out(tool).state, MachineState::kIdle);
  tool.tool_acknowledged = true;
  EXPECT_EQ(sim_state::ran_out(tool).state, MachineState::kTool);
  SimState limit = in(MachineState::kIdle);
  limit.limit_hit = true;
  EXPECT_EQ(sim_state::due(limit, kSlowing, 0.0), Due::kNothing);
  EXPECT_EQ(sim_state::due(limit, kHeld, 0.0), Due::kLimit);
}

/// What is left of a line.
std::pair<SimIntake, int> read(std::string_view text, const SimIntakeRules& rules) {
  SimIntake intake;
  int ends = 0;
  for (const char c : text) {
    SimTaken next = taken(std::move(intake), c, rules);
    intake = std::move(next.intake);
    ends += next.ended ? 1 : 0;
  }
  return {intake, ends};
}

TEST(SimIntake, LeavesOutBlanksAndComments) {
  EXPECT_EQ(read("g1 (a) x2 /;end", {}).first.line, "G1X2");
  EXPECT_FALSE(read("X1 X2", {4, false}).first.overflows);
  EXPECT_TRUE(read("X1 X2 Y", {4, false}).first.overflows);
}

TEST(SimIntake, GrblTakesCrLfForTwoEnds) {
  EXPECT_EQ(read("G0\r\n\n", {79, false}).second, 3);
  EXPECT_EQ(read("G0\r\n\n", {79, true}).second, 2);
}

TEST(SimIntake, TheBufferForgetsWhatIsRead) {
  SimBuffer buffer;
  buffer.add('a');
  buffer.add('b');
  ++buffer.read;
  EXPECT_EQ(buffer.rest(), "b");
  ++buffer.read;
  EXPECT_TRUE(buffer.empty());
  buffer.add('c');
  EXPECT_EQ(buffer.bytes, "c");
}

TEST(SimReport, OffsetsAndOverridesComeNowAndThenAndNeverTogether) {
  SimSnapshot machine;
  machine.state = "Idle";
  machine.mask = 3;
  machine.free_blocks = 15;
  machine.free_bytes = 128;
  SimReport report = report_of(machine, {});
  EXPECT_EQ(report.text,
            "<Idle|MPos:0.000,0.000,0.000|Bf:15,128|FS:0,0|WCO:0.000,0.000,0.000>\r\n");
  report = report_of(machine, report.next);
  EXPECT_THAT(report.text, HasSubstr("|Ov:100,100,100>"));
  for (int i = 0; i < 8; ++i) {
    report = report_of(machine, report.next);
    EXPECT_THAT(report.text, Not(HasSubstr("Ov"))) << i;
    EXPECT_THAT(report.text, Not(HasSubstr("WCO"))) << i;
  }
  EXPECT_THAT(report_of(machine, report.next).text, HasSubstr("WCO"));
}

TEST(SimReport, OverridesKeepToTheirRange) {
  SimOverrides now;
  for (int i = 0; i < 12; ++i) now = *overridden(now, 0x91);
  EXPECT_EQ(now.feed, 200.0);
  EXPECT_EQ(overridden(now, 0x90)->feed, 100.0);
  EXPECT_EQ(overridden(now, 0x97)->rapid, 25.0);
  EXPECT_EQ(overridden(now, 0x9D)->spindle, 99.0);
  EXPECT_FALSE(overridden(now, 0x98));
  EXPECT_FALSE(overridden(now, 0x9E));
}

}  // namespace
}  // namespace lensforge
