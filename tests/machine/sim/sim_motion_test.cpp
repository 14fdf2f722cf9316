// SPDX-License-Identifier: GPL-3.0-or-later
// Motion, holds, resets, alarms and the door.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "machine/sim_talk.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

double number_after(const std::string& text, const std::string& name) {
  return std::stod(text.substr(text.find(name) + name.size()));
}

TEST(SimulatedMotion, FollowsATrapezoidInTime) {
  Talk talk(ready_grbl());
  talk.command("G21 G91");
  talk.command("G1 X50 F3000");  // 50 mm/s, 500 mm/s²
  talk.settle();
  ASSERT_EQ(talk.pieces.size(), 1U);
  const ExecutedPiece& piece = talk.pieces[0];
  EXPECT_NEAR(piece.end_time - piece.begin_time, 1.0 + 50.0 / 500.0, 1e-9);
  EXPECT_EQ(piece.feed, 3000.0);
  EXPECT_EQ(piece.end, Vector3d(50, 0, 0));
  EXPECT_TRUE(piece.complete);
}

TEST(SimulatedMotion, ReportsWhereItIsAndHowFast) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X50 F3000");
  const double begin = talk.machine.now();
  talk.listen(0.5);
  const std::string report = talk.status();
  EXPECT_THAT(report, StartsWith("<Run|"));
  EXPECT_THAT(report, HasSubstr("|FS:3000,0"));
  const double passed = talk.machine.now() - begin;
  // Half an acceleration behind: x = v(t − v/2a).
  EXPECT_NEAR(number_after(report, "MPos:"), 50.0 * (passed - 0.05), 0.5);
}

TEST(SimulatedMotion, HoldStopsKeepsThePositionAndResumes) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X50 F3000");
  talk.listen(0.5);
  talk.send("!");
  EXPECT_THAT(talk.status(), StartsWith("<Hold:1|"));
  talk.listen(0.5);
  const std::string held = talk.status();
  EXPECT_THAT(held, StartsWith("<Hold:0|"));
  const double x = number_after(held, "MPos:");
  EXPECT_GT(x, 10.0);
  EXPECT_LT(x, 40.0);
  talk.listen(5.0);
  EXPECT_EQ(number_after(talk.status(), "MPos:"), x);
  EXPECT_TRUE(talk.pieces.empty());
  talk.send("~");
  talk.settle();
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_EQ(talk.pieces[0].end, Vector3d(50, 0, 0));
}

TEST(SimulatedMotion, HoldStopsAsFastAsTheAxisAllows) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X100 F6000");
  talk.listen(0.6);
  const double begin = talk.machine.controller().position().x();
  talk.send("!");
  while (talk.machine.controller().moving()) talk.listen(0.0001);
  // v²/2a at 100 mm/s and 500 mm/s²; the command itself needs 1 ms and its byte.
  EXPECT_NEAR(talk.machine.controller().position().x() - begin, 10.0, 0.3);
}

TEST(SimulatedMotion, NothingIsReadInAHold) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X10 F3000");
  talk.send("!");
  talk.listen(0.5);
  talk.send("G1 X10\n$G\n");
  EXPECT_EQ(talk.listen(1.0), "");
  talk.send("~");
  EXPECT_THAT(talk.listen(0.1), StartsWith("ok\r\n[GC:"));
}

TEST(SimulatedMotion, ResetInAHoldKeepsThePosition) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X50 F3000");
  talk.listen(0.5);
  talk.send("!");
  talk.listen(1.0);
  const Vector3d stands = talk.machine.controller().true_position();
  talk.send("\x18");
  const std::string heard = talk.listen(0.1);
  EXPECT_THAT(heard, HasSubstr("Grbl 1.1h"));
  EXPECT_EQ(heard.find("ALARM"), std::string::npos);
  EXPECT_THAT(talk.status(), StartsWith("<Idle|"));
  const double step = 1.0 / 800.0;
  EXPECT_LT((talk.machine.controller().position() - stands).norm(), step);
  EXPECT_LT((talk.machine.controller().true_position() - stands).norm(), step);
  ASSERT_EQ(talk.pieces.size(), 1U);
  EXPECT_FALSE(talk.pieces[0].complete);
}

TEST(SimulatedMotion, ResetInMotionLosesThePosition) {
  for (const bool holding : {false, true}) {
    Talk talk(ready_grbl());
    talk.command("G21 G91 G1 X50 F6000 S1000 M3");
    talk.listen(0.3);
    if (holding) talk.send("!");
    talk.listen(0.01);
    talk.send("\x18");
    const std::string heard = talk.listen(0.1);
    EXPECT_THAT(heard, StartsWith("ALARM:3\r\n\r\nGrbl 1.1h"));
    EXPECT_THAT(heard, HasSubstr("[MSG:'$H'|'$X' to unlock]"));
    EXPECT_GT(
        (talk.machine.controller().true_position() - talk.machine.controller().position()).norm(),
        0.1);
    EXPECT_EQ(talk.machine.controller().spindle(), 0);
    EXPECT_EQ(talk.command("G0 X1"), "error:9\r\n");
    EXPECT_EQ(talk.command("$X"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    EXPECT_EQ(talk.command("G0 X1"), "ok\r\n");
  }
}

TEST(SimulatedMotion, HomingFindsTheTruth) {
  Talk talk(simulated_grbl());
  EXPECT_EQ(talk.command("G0 X1"), "error:9\r\n");
  EXPECT_FALSE(talk.machine.controller().homed());
  EXPECT_EQ(talk.command("$H"), "ok\r\n");
  EXPECT_TRUE(talk.machine.controller().homed());
  EXPECT_THAT(talk.status(), StartsWith("<Idle|MPos:-2.000,-2.000,-2.000"));
  EXPECT_EQ(talk.machine.controller().true_position(), Vector3d(-2, -2, -2));
}

TEST(SimulatedMotion, HomingFailsAsItDoes) {
  Talk reset(simulated_grbl());
  reset.send("$H\n");
  reset.listen(1.0);
  EXPECT_EQ(reset.machine.controller().state(), MachineState::kHome);
  reset.send("?");
  EXPECT_EQ(reset.listen(0.5), "");
  reset.send("\x18");
  EXPECT_THAT(reset.listen(0.1), StartsWith("ALARM:6\r\n"));
  Talk door(simulated_grbl());
  door.send("$H\n");
  door.listen(1.0);
  door.machine.controller().move_door(true);
  EXPECT_THAT(door.listen(0.1), StartsWith("ALARM:7\r\n"));
  for (const int alarm : {8, 9}) {
    Talk talk(simulated_grbl());
    talk.machine.controller().fail_next_homing(alarm);
    talk.send("$H\n");
    EXPECT_THAT(talk.listen(60.0), StartsWith("ALARM:" + std::to_string(alarm) + "\r\n"));
    EXPECT_FALSE(talk.machine.controller().homed());
  }
}

TEST(SimulatedMotion, SoftLimitStopsThenLocks) {
  Talk talk(simulated_grbl());
  talk.home();
  talk.command("G21 G90 G1 X-50 F3000");
  talk.send("X10\nX-60\n");
  const std::string heard = talk.listen(2.0);
  EXPECT_EQ(heard, "ALARM:2\r\n[MSG:Reset to continue]\r\n");
  EXPECT_EQ(talk.machine.controller().true_position(), talk.machine.controller().position());
  talk.send("?$X\n");
  EXPECT_EQ(talk.listen(0.5), "");
  talk.send("\x18");
  EXPECT_THAT(talk.listen(0.1), HasSubstr("to unlock]"));
  EXPECT_THAT(talk.command("$X"), HasSubstr("Unlocked"));
  EXPECT_EQ(talk.command("$J=G91 X500 F100"), "error:15\r\n");
}

TEST(SimulatedMotion, SoftLimitIsFoundInCheckMode) {
  Talk talk(simulated_grbl());
  talk.home();
  talk.command("$C");
  talk.send("G21 G90 G0 X-500\n");
  EXPECT_THAT(talk.listen(0.5), StartsWith("ALARM:2\r\n"));
}

TEST(SimulatedMotion, LimitSwitchStopsAtOnce) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X50 F6000");
  talk.listen(0.3);
  talk.machine.controller().raise_alarm(1);
  EXPECT_EQ(talk.listen(0.1), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
  EXPECT_FALSE(talk.machine.controller().moving());
  EXPECT_NE(talk.machine.controller().true_position(), talk.machine.controller().position());
}

TEST(SimulatedMotion, DoorStopsMotionThenSpindle) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 S1000 M3");
  talk.command("G1 X50 F3000");
  talk.listen(0.5);
  talk.machine.controller().move_door(true);
  EXPECT_THAT(talk.listen(0.01), StartsWith("[MSG:Check Door]\r\n"));
  EXPECT_THAT(talk.status(), StartsWith("<Door:2|"));
  EXPECT_EQ(talk.machine.controller().spindle(), 1);
  talk.listen(0.5);
  EXPECT_THAT(talk.status(), StartsWith("<Door:1|"));
  EXPECT_THAT(talk.status(), HasSubstr("|Pn:D"));
  EXPECT_EQ(talk.machine.controller().spindle(), 0);
  talk.send("~");
  EXPECT_THAT(talk.status(), StartsWith("<Door:1|"));
  talk.machine.controller().move_door(false);
  EXPECT_THAT(talk.status(), StartsWith("<Door:0|"));
  talk.send("~");
  EXPECT_THAT(talk.status(), StartsWith("<Door:3|"));
  EXPECT_EQ(talk.machine.controller().spindle(), 1);
  talk.listen(4.1);
  EXPECT_THAT(talk.status(), StartsWith("<Run|"));
  talk.settle();
  EXPECT_EQ(talk.pieces.back().end, Vector3d(50, 0, 0));
}

TEST(SimulatedMotion, DoorCommandNeedsNoDoor) {
  Talk talk(ready_grbl());
  talk.send("\x84");
  talk.listen(0.1);
  EXPECT_THAT(talk.status(), StartsWith("<Door:0|"));
  talk.send("~");
  talk.listen(0.1);
  EXPECT_THAT(talk.status(), StartsWith("<Idle|"));
}

TEST(SimulatedMotion, OverridesScaleTheFeed) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X50 F1200");
  talk.listen(0.5);
  talk.send("\x92\x92\x94");  // −10 −10 −1
  talk.listen(0.3);
  const std::string report = talk.status() + talk.status();
  EXPECT_THAT(report, HasSubstr("|FS:948,0"));
  EXPECT_THAT(report, HasSubstr("|Ov:79,100,100"));
  talk.send("\x90");
  talk.listen(0.3);
  EXPECT_THAT(talk.status(), HasSubstr("|FS:1200,0"));
}

TEST(SimulatedMotion, CornersAreTakenAtTheirJunctionSpeed) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 F3000");
  talk.send("G1 X30\nG1 Y30\n");
  talk.listen(0.1);
  talk.settle();
  ASSERT_EQ(talk.pieces.size(), 2U);
  const double s = std::sqrt(0.5);
  const double corner = std::sqrt(500.0 * std::sqrt(2.0) * 0.02 * s / (1.0 - s));
  const double up = 50.0 / 500.0;
  const double down = (50.0 - corner) / 500.0;
  const double along = (30.0 - 25.0 * up - 0.5 * (50.0 + corner) * down) / 50.0;
  for (const ExecutedPiece& piece : talk.pieces) {
    EXPECT_NEAR(piece.end_time - piece.begin_time, up + down + along, 1e-6);
  }
}

TEST(SimulatedMotion, ArcsStayWithinTheArcTolerance) {
  Talk talk(ready_grbl());
  talk.command("G21 G90 F1000");
  talk.command("G2 X0 Y0 I10 Z-1");
  talk.settle();
  EXPECT_GT(talk.pieces.size(), 90U);
  for (const ExecutedPiece& piece : talk.pieces) {
    const Vector3d middle = 0.5 * (piece.start + piece.end) - Vector3d(10, 0, 0);
    EXPECT_NEAR(middle.head<2>().norm(), 10.0, 0.005 + 1.0 / 800.0);
  }
  EXPECT_EQ(talk.pieces.back().end, Vector3d(0, 0, -1));
}

TEST(SimulatedMotion, LosesItsCountWithItsPower) {
  Talk talk(simulated_grbl());
  talk.home();
  talk.command("G21 G90 G0 X-50 Y-50");
  talk.settle();
  talk.machine.controller().power_cycle();
  EXPECT_THAT(talk.listen(0.1), HasSubstr("Grbl 1.1h"));
  EXPECT_EQ(talk.machine.controller().position(), Vector3d::Zero().eval());
  EXPECT_EQ(talk.machine.controller().true_position(), Vector3d(-50, -50, -2));
  EXPECT_FALSE(talk.machine.controller().homed());
  EXPECT_EQ(talk.machine.controller().state(), MachineState::kAlarm);
}

TEST(SimulatedMotion, SleepEndsInAnAlarm) {
  Talk talk(ready_grbl());
  EXPECT_EQ(talk.command("$SLP"), "[MSG:Sleeping]\r\nok\r\n");
  EXPECT_THAT(talk.status(), StartsWith("<Sleep|"));
  talk.send("G21\n");
  EXPECT_EQ(talk.listen(0.5), "");
  talk.send("\x18");
  EXPECT_THAT(talk.listen(0.1), HasSubstr("to unlock]"));
}

TEST(SimulatedMotion, TellsOfAPieceAsItBegins) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 G1 X10 F600");
  talk.command("N3 X10");
  talk.listen(0.3);
  ASSERT_EQ(talk.begun.size(), 1U);
  EXPECT_EQ(talk.begun[0].end, Vector3d(10, 0, 0));
  EXPECT_TRUE(talk.pieces.empty());
  talk.settle();
  ASSERT_EQ(talk.begun.size(), 2U);
  EXPECT_EQ(talk.begun[1].number, 3);
  EXPECT_EQ(talk.begun[1].begin_time, talk.pieces[0].end_time);
}

TEST(SimulatedMotion, PiecesCarryLineAndSpindle) {
  Talk talk(ready_grbl());
  talk.command("G21 G91 S1000 M3");
  talk.command("N7 G1 X1 F600");
  talk.command("G0 Y1");
  talk.command("M5");
  talk.command("N9 G1 X1");
  talk.settle();
  ASSERT_EQ(talk.pieces.size(), 3U);
  EXPECT_EQ(talk.pieces[0].number, 7);
  EXPECT_EQ(talk.pieces[0].spindle, 1);
  EXPECT_EQ(talk.pieces[0].rpm, 1000.0);
  EXPECT_TRUE(talk.pieces[1].rapid);
  EXPECT_EQ(talk.pieces[1].number, 0);
  EXPECT_EQ(talk.pieces[2].spindle, 0);
  EXPECT_EQ(talk.pieces[2].received, 5);
}

}  // namespace
}  // namespace lensforge
