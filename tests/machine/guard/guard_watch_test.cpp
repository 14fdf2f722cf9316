// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/guard/spindle_guard.h"
#include "machine/guard_clock.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// The generic PLC: 3 readings, 5 %, 2 lost, fault, at-speed and direction.
class SpindleWatchTest : public ::testing::Test {
 protected:
  /// A whole round of readings.
  void see(double rpm, double time, std::uint16_t fault = 0) {
    watch_.see_fault(fault, time);
    watch_.see_at_speed(true, time);
    watch_.see_direction(0, time);
    watch_.see_speed(rpm, time);
  }
  void reach(double rpm) {
    watch_.expect_speed(rpm, true, 0.0);
    watch_.command_taken(0.1);
    for (const double time : {1.0, 1.1, 1.2, 1.3}) see(rpm, time);
    ASSERT_EQ(watch_.state(), SpindleState::kAtSpeed) << watch_.reason();
  }

  SpindleMap map_ = *testing::shipped_map("generic_plc").spindle;
  SpindleWatch watch_{map_};
};

TEST_F(SpindleWatchTest, BelievesNoSpeedBeforeThreeReadingsInARow) {
  watch_.expect_speed(10000.0, true, 0.0);
  watch_.command_taken(0.1);
  see(10000.0, 1.0);
  see(10000.0, 1.1);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
  see(9400.0, 1.2);
  see(10000.0, 1.3);
  see(10000.0, 1.4);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
  see(10000.0, 1.5);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
}

TEST_F(SpindleWatchTest, TakesTheToleranceOfTheSpeedAskedFor) {
  reach(10000.0);
  for (int i = 0; i < 5; ++i) see(9501.0, 2.0 + i);
  for (int i = 0; i < 5; ++i) see(10499.0, 8.0 + i);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
  see(9499.0, 14.0);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed) << "one reading is not a loss";
  see(9499.0, 14.1);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), AllOf(HasSubstr("9499 rpm"), HasSubstr("10000 rpm within 5 %"),
                                     HasSubstr("2 readings in a row")));
}

TEST_F(SpindleWatchTest, DoesNotCountReadingsFromBeforeTheCommand) {
  see(10000.0, 0.0);
  watch_.expect_speed(10000.0, true, 1.0);
  for (const double time : {1.0, 1.1, 1.2, 1.3}) see(10000.0, time);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
  watch_.command_taken(1.4);
  see(10000.0, 1.5);
  see(10000.0, 1.6);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
}

TEST_F(SpindleWatchTest, NeverBelievesTheAtSpeedSignalAlone) {
  watch_.expect_speed(10000.0, true, 0.0);
  watch_.command_taken(0.1);
  for (int i = 0; i < 140; ++i) {
    see(0.0, 0.2 + 0.1 * i);
    ASSERT_EQ(watch_.state(), SpindleState::kChanging) << i;
  }
  for (int i = 0; i < 10; ++i) see(0.0, 14.5 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), AllOf(HasSubstr("speed reads 0 rpm"), HasSubstr("15 s after")));
}

TEST_F(SpindleWatchTest, WaitsForEveryOtherSignalToAgree) {
  watch_.expect_speed(10000.0, true, 0.0);
  watch_.command_taken(0.1);
  for (int i = 0; i < 5; ++i) watch_.see_speed(10000.0, 1.0 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging) << "nothing else was read";
  watch_.see_fault(0, 2.0);
  watch_.see_at_speed(true, 2.0);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging) << "the direction was not read";
  watch_.see_direction(1, 2.1);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging) << "it turns the other way";
  watch_.see_direction(0, 2.2);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
}

TEST_F(SpindleWatchTest, DoesNotBelieveAFaultRegisterReadBeforeTheSpeedWasGood) {
  watch_.expect_speed(10000.0, true, 0.0);
  watch_.command_taken(0.1);
  see(4000.0, 0.5);
  watch_.see_at_speed(true, 1.0);
  watch_.see_direction(0, 1.0);
  for (int i = 0; i < 5; ++i) watch_.see_speed(10000.0, 1.0 + 0.1 * i);
  watch_.see_at_speed(true, 1.5);
  watch_.see_direction(0, 1.5);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
  watch_.see_fault(0, 1.6);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
}

TEST_F(SpindleWatchTest, FailsAtOnceOnAFaultAndStaysFailedUntilTheNextRequest) {
  reach(10000.0);
  watch_.see_fault(2, 2.0);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_EQ(watch_.reason(), "fault 2: spindle too hot");
  for (int i = 0; i < 10; ++i) see(10000.0, 2.1 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  watch_.expect_speed(10000.0, true, 4.0);
  watch_.command_taken(4.1);
  for (int i = 0; i < 4; ++i) see(10000.0, 4.2 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
}

TEST_F(SpindleWatchTest, TellsTheFaultOfADriveThatWasSeenToLoseSpeedFirst) {
  reach(10000.0);
  watch_.see_speed(7000.0, 2.0);
  watch_.see_speed(5000.0, 2.1);
  EXPECT_THAT(watch_.reason(), HasSubstr("speed reads 5000 rpm"));
  watch_.see_fault(2, 2.2);
  EXPECT_THAT(watch_.reason(),
              AllOf(HasSubstr("speed reads 5000 rpm"), HasSubstr("; fault 2: spindle too hot")));
}

TEST_F(SpindleWatchTest, NamesAFaultWithoutText) {
  watch_.see_fault(77, 1.0);
  EXPECT_EQ(watch_.reason(), "fault 77: no text in the register map");
}

TEST_F(SpindleWatchTest, FailsWhereTheAtSpeedSignalGoesOff) {
  reach(10000.0);
  watch_.see_at_speed(false, 2.0);
  EXPECT_EQ(watch_.state(), SpindleState::kAtSpeed);
  watch_.see_at_speed(false, 2.1);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), HasSubstr("at-speed signal is off"));
}

TEST_F(SpindleWatchTest, FailsWhereItTurnsTheOtherWay) {
  watch_.expect_speed(10000.0, false, 0.0);
  watch_.command_taken(0.1);
  for (int i = 0; i < 160; ++i) see(10000.0, 0.2 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), HasSubstr("does not turn counter-clockwise"));
}

TEST_F(SpindleWatchTest, BusTroubleWhileCuttingStaysAFailureAfterTheBusIsBack) {
  reach(10000.0);
  watch_.set_bus_trouble("no answer");
  watch_.set_bus_trouble("");
  for (int i = 0; i < 10; ++i) see(10000.0, 2.0 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_EQ(watch_.reason(), "no answer");
}

TEST_F(SpindleWatchTest, BusTroubleOfAnIdleSpindleEndsWithItsCause) {
  for (int i = 0; i < 4; ++i) see(0.0, 1.0 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kStopped);
  watch_.set_bus_trouble("no answer");
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  watch_.set_bus_trouble("");
  EXPECT_EQ(watch_.state(), SpindleState::kStopped);
}

TEST_F(SpindleWatchTest, BelievesAStandstillOnlyByReadings) {
  EXPECT_EQ(watch_.state(), SpindleState::kChanging) << "nothing was read yet";
  reach(10000.0);
  watch_.expect_stop(3.0);
  watch_.command_taken(3.1);
  see(5000.0, 3.2);
  see(60.0, 3.3);
  see(61.0, 3.4);
  see(0.0, 3.5);
  see(0.0, 3.6);
  EXPECT_EQ(watch_.state(), SpindleState::kChanging);
  see(0.0, 3.7);
  see(0.0, 3.8);
  EXPECT_EQ(watch_.state(), SpindleState::kStopped);
}

TEST_F(SpindleWatchTest, FailsWhereItDoesNotStopInTime) {
  reach(10000.0);
  watch_.expect_stop(3.0);
  watch_.command_taken(3.1);
  for (int i = 0; i < 310; ++i) see(5000.0, 3.2 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), AllOf(HasSubstr("5000 rpm"), HasSubstr("30 s after the stop")));
  for (int i = 0; i < 5; ++i) see(0.0, 40.0 + 0.1 * i);
  EXPECT_EQ(watch_.state(), SpindleState::kStopped) << watch_.reason();
}

TEST_F(SpindleWatchTest, FailsWhereAStoppedSpindleTurns) {
  for (int i = 0; i < 4; ++i) see(0.0, 1.0 + 0.1 * i);
  see(300.0, 2.0);
  EXPECT_EQ(watch_.state(), SpindleState::kStopped);
  see(600.0, 2.1);
  EXPECT_EQ(watch_.state(), SpindleState::kFailed);
  EXPECT_THAT(watch_.reason(), HasSubstr("at most 60 rpm is stopped"));
}

}  // namespace
}  // namespace lensforge
