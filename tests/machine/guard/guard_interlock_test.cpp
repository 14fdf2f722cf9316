// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "core/temp_folder.h"
#include "machine/guard_workshop.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::kRamp;
using testing::kStep;
using testing::ManualClock;
using testing::message_of;
using testing::Workshop;

TEST(SpindleGuard, InterlocksAreNotOkBeforeTheyAreRead) {
  Workshop shop("generic_plc");
  shop.trouble(SpindleTrouble::kSilent);
  const GuardReport report = shop.guard.poll();
  EXPECT_FALSE(report.interlocks_ok);
  EXPECT_THAT(report.reason, AllOf(HasSubstr("PLC: door: not read yet"), HasSubstr("e-stop")));
}

TEST(SpindleGuard, TellsWhichInterlockIsOpen) {
  Workshop shop("generic_plc");
  shop.reach(12000.0);
  EXPECT_TRUE(shop.run(1.0).interlocks_ok);
  shop.trouble(SpindleTrouble::kInterlock, 1.0, 0.0, "vacuum");
  const GuardReport report = shop.run(0.25);
  EXPECT_FALSE(report.interlocks_ok);
  EXPECT_EQ(report.reason, "PLC: vacuum: reads 0: 1 is needed");
  EXPECT_EQ(report.spindle, SpindleState::kAtSpeed);
  EXPECT_TRUE(shop.run(1.5).interlocks_ok);
}

TEST(SpindleGuard, InterlocksThatCannotBeReadAreNotOk) {
  Workshop shop("generic_plc");
  EXPECT_TRUE(shop.run(1.0).interlocks_ok);
  shop.trouble(SpindleTrouble::kSilent);
  const GuardReport report = shop.run(3.0);
  EXPECT_FALSE(report.interlocks_ok);
  EXPECT_THAT(report.reason, HasSubstr("door (discrete input 0x0000): no"));
}

/// A drive on one bus, interlocks on another.
TEST(SpindleGuard, WatchesSeveralDevices) {
  ManualClock clock;
  RegisterMap plc_map = testing::shipped_map("generic_plc");
  plc_map.spindle.reset();
  SimulatedSpindle drive(testing::shipped_map("yl620"), clock, kRamp);
  SimulatedSpindle plc(plc_map, clock);
  std::vector<GuardedDevice> devices;
  devices.push_back({plc_map, plc.bus()});
  devices.push_back({testing::shipped_map("yl620"), drive.bus()});
  SpindleGuard guard(std::move(devices), {}, clock);
  const auto run = [&](double seconds) {
    GuardReport report;
    for (const double end = clock.now() + seconds; clock.now() < end; clock.wait(kStep)) {
      report = guard.poll();
    }
    return report;
  };
  guard.spin(12000.0, true);
  GuardReport report = run(5.0);
  EXPECT_EQ(report.spindle, SpindleState::kAtSpeed) << report.reason;
  EXPECT_TRUE(report.interlocks_ok);
  plc.add({SpindleTrouble::kDown, clock.now(), 1e9, 0.0, {}});
  report = run(3.0);
  EXPECT_EQ(report.spindle, SpindleState::kAtSpeed) << "the drive's bus is well";
  EXPECT_FALSE(report.interlocks_ok);
}

TEST(SpindleGuard, NeedsExactlyOneSpindleWithCommandsForTheHost) {
  ManualClock clock;
  RegisterMap map = testing::shipped_map("yl620");
  SimulatedSpindle spindle(map, clock);
  const auto guard_of = [&](std::vector<RegisterMap> maps, SpindleOwner owner) {
    return message_of<InputError>([&] {
      std::vector<GuardedDevice> devices;
      devices.reserve(maps.size());
      for (RegisterMap& each : maps) devices.push_back({std::move(each), spindle.bus()});
      SpindleGuard guard(std::move(devices), {owner}, clock);
    });
  };
  RegisterMap silent = testing::shipped_map("generic_plc");
  silent.spindle.reset();
  EXPECT_THAT(guard_of({silent}, SpindleOwner::kHost), HasSubstr("one must have a spindle"));
  EXPECT_THAT(guard_of({map, map}, SpindleOwner::kHost), HasSubstr("only one may have a spindle"));
  map.spindle->commands.reset();
  EXPECT_THAT(guard_of({map}, SpindleOwner::kHost), HasSubstr("YL620: has no spindle.commands"));
}

std::string told(const std::vector<GuardRecord>& records, GuardEvent event) {
  std::string all;
  for (const GuardRecord& record : records) {
    if (record.event == event) all += record.text + "|";
  }
  return all;
}

TEST(SpindleGuard, RecordsCommandsStatesSpeedsAndTroubles) {
  Workshop shop("generic_plc");
  shop.run(1.0);
  shop.reach(12000.0);
  shop.run(10.0);
  shop.trouble(SpindleTrouble::kInterlock, 1.0, 0.0, "door");
  shop.run(2.0);
  shop.trouble(SpindleTrouble::kFault, 1e9, 1.0);
  shop.run(1.0);
  const std::vector<GuardRecord> records = shop.guard.take_records();
  EXPECT_EQ(told(records, GuardEvent::kCommand), "spin 12000 rpm clockwise|");
  EXPECT_EQ(told(records, GuardEvent::kState), "stopped|changing|at speed|failed|");
  EXPECT_EQ(told(records, GuardEvent::kTrouble), "PLC: fault 1: drive fault|");
  EXPECT_EQ(told(records, GuardEvent::kInterlock), "PLC: door: reads 0: 1 is needed||");
  const auto speeds = std::count_if(records.begin(), records.end(), [](const GuardRecord& record) {
    return record.event == GuardEvent::kSpeed;
  });
  // 1.5 s of ramp at 10 Hz, then one a second for 12 s, then the fall for 1 s at 10 Hz
  EXPECT_GE(speeds, 25);
  EXPECT_LE(speeds, 45);
  EXPECT_TRUE(std::is_sorted(records.begin(), records.end(),
                             [](const auto& a, const auto& b) { return a.time < b.time; }));
  EXPECT_TRUE(shop.guard.take_records().empty());
}

TEST(SimulatedSpindle, RampsAsItsRateSays) {
  ManualClock clock;
  SimulatedSpindle spindle(testing::shipped_map("yl620"), clock, 4000.0);
  spindle.drive(10000.0, false);
  clock.wait(1.0);
  EXPECT_NEAR(spindle.rpm(), -4000.0, 1e-6);
  clock.wait(9.0);
  EXPECT_NEAR(spindle.rpm(), -10000.0, 1e-6);
  spindle.add({SpindleTrouble::kFault, clock.now() + 1.0, clock.now() + 2.0, 1.0, {}});
  clock.wait(1.5);
  EXPECT_NEAR(spindle.rpm(), -8000.0, 1e-6);
  clock.wait(9.0);
  EXPECT_EQ(spindle.rpm(), 0.0) << "a drive that tripped waits for a new start";
}

TEST(SpindleGuard, ReadsInterlocksWhileCommandsFail) {
  RegisterMap map = testing::shipped_map("generic_plc");
  Workshop shop(map, map, SpindleOwner::kHost);
  shop.trouble(SpindleTrouble::kWrongEcho);
  shop.guard.stop();
  shop.run(8.0);
  shop.trouble(SpindleTrouble::kInterlock, 100.0, 0.0, "door");
  shop.only_failed = true;
  const GuardReport report = shop.run(6.0);
  EXPECT_TRUE(shop.only_failed) << "a stop that is not taken is a failure, though nothing turns";
  EXPECT_TRUE(shop.guard.commands_pending());
  EXPECT_THAT(report.reason, HasSubstr("PLC: door: reads 0: 1 is needed"));
}

}  // namespace
}  // namespace lensforge
