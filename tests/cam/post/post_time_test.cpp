// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cam/post/program_reader.h"
#include "cam/post/program_writer.h"
#include "cam/post_plans.h"

namespace lensforge::post_time_test {
namespace {

using namespace lensforge::testing;

PlannerSettings slow_machine() {
  PlannerSettings settings;
  settings.max_rate = {3000.0, 3000.0, 3000.0};
  settings.acceleration = {100.0, 100.0, 100.0};
  settings.steps_per_mm = Eigen::Vector3d::Zero();
  settings.blocks = 16;
  return settings;
}

ProgramTime time_of(const std::string& program, const PlannerSettings& settings) {
  const TempFolder folder;
  write_bytes(folder / "a.ngc", program);
  ProgramTimer timer(settings, 30.0);
  walk_program(folder / "a.ngc", linuxcnc_dialect(),
               [&](const ProgramLine& line) { timer.take(line); }, {});
  return timer.finish();
}

const std::string kHead = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nS1000 M3\n";

TEST(ProgramTime, ALongMoveTakesItsRampsAsWell) {
  // v = 10 mm/s, a = 100 mm/s²: ramps of 0.1 s over 0.5 mm each, 99 mm at speed.
  const ProgramTime time = time_of(kHead + "G1 X100 F600\nM2\n", slow_machine());
  EXPECT_NEAR(time.seconds, 0.1 + 9.9 + 0.1, 1e-9);
}

TEST(ProgramTime, AnAxisLimitSlowsTheWholeMove) {
  PlannerSettings settings = slow_machine();
  settings.acceleration = {1e9, 1e9, 1e9};
  settings.max_rate = {3000.0, 3000.0, 300.0};
  // 3-4-5 triangle: Z at 5 mm/s, so 4 mm take 0.8 s.
  EXPECT_NEAR(time_of(kHead + "G1 X3 Z4 F3000\nM2\n", settings).seconds, 0.8, 1e-6);
}

TEST(ProgramTime, ReversalsCostWhatAccelerationSays) {
  // From rest to rest over 1 mm at 100 mm/s²: 2√(1/100) = 0.2 s, far below the feed.
  std::string program = kHead + "G1 F30000\n";
  for (int i = 0; i < 50; ++i) program += i % 2 == 0 ? "X1\n" : "X0\n";
  PlannerSettings settings = slow_machine();
  settings.max_rate = {1e6, 1e6, 1e6};
  const ProgramTime time = time_of(program + "M2\n", settings);
  EXPECT_NEAR(time.seconds, 50 * 0.2, 1e-6);
}

TEST(ProgramTime, DwellsAndToolChangesAreWaitedFor) {
  const ProgramTime time = time_of(kHead + "G4 P2.5\nT2 M6\nM2\n", slow_machine());
  EXPECT_NEAR(time.seconds, 32.5, 1e-9);
}

TEST(ProgramTime, ASlowLinkStarvesTheController) {
  // 0.05 mm at 10 mm/s: 200 lines a second are needed.
  std::string program = kHead + "G1 F600\n";
  for (int i = 1; i <= 4000; ++i) program.append("X").append(std::to_string(i * 0.05)).append("\n");
  PlannerSettings settings = slow_machine();
  settings.max_rate = {1e5, 1e5, 1e5};
  settings.acceleration = {1e6, 1e6, 1e6};
  const ProgramTime free = time_of(program + "M2\n", settings);
  EXPECT_NEAR(free.peak_lines_per_second, 200.0, 20.0);
  settings.lines_per_second = 100.0;
  const ProgramTime limited = time_of(program + "M2\n", settings);
  EXPECT_NEAR(limited.seconds, free.seconds, 1e-9);
  EXPECT_NEAR(limited.stream_limited_seconds, 40.0, 1.0);
}

TEST(ProgramTime, StretchesAddUp) {
  ProgramTime a = time_of(kHead + "G1 X100 F600\nM2\n", slow_machine());
  const ProgramTime b = time_of(kHead + "G1 X50 F300\nM2\n", slow_machine());
  const double seconds = a.seconds + b.seconds;
  a += b;
  EXPECT_NEAR(a.seconds, seconds, 1e-12);
}

TEST(ProgramTime, EachOperationIsTimedInEveryFile) {
  ProgramPlan plan;
  const auto row = [](double y) {
    return std::vector<PathMove>{straight(MoveKind::kRapid, {0.0, y, 5.0}),
                                 straight(MoveKind::kPlunge, {0.0, y, 0.0}, 150.0),
                                 straight(MoveKind::kCut, {100.0, y, 0.0}, 600.0)};
  };
  plan.operations = {operation_of("a", small_ball(), row(0.0)),
                     operation_of("b", small_ball(), row(50.0))};
  ProgramSettings settings;
  settings.planner = slow_machine();
  settings.grouping = ProgramGrouping::kAll;
  const TempFolder folder;
  const ProgramFiles files =
      write_programs(plan, post_named("linuxcnc"), settings, folder.path(), {});
  ASSERT_EQ(files.times.size(), 2U);
  // 5 mm down at 2.5 mm/s with ramps of 0.025 s, then 100 mm as above; the corner is a standstill.
  const double cut = 2.025 + 10.1;
  EXPECT_GT(files.times[1].seconds, cut);
  EXPECT_LT(files.times[1].seconds, cut + 6.0);
  // The first one waits for the tool and the spindle, too.
}

TEST(ProgramTime, TheWorkshopsMachineSetsThePlanner) {
  Machine machine;
  machine.max_rate = {1.0, 2.0, 3.0};
  machine.look_ahead = 77;
  machine.lines_per_second = 500.0;
  const PlannerSettings settings = planner_settings(machine);
  EXPECT_EQ(settings.max_rate, machine.max_rate);
  EXPECT_EQ(settings.acceleration, machine.acceleration);
  EXPECT_EQ(settings.blocks, 77);
  EXPECT_EQ(settings.lines_per_second, 500.0);
  EXPECT_EQ(settings.junction_deviation, machine.junction_deviation);
}

}  // namespace
}  // namespace lensforge::post_time_test
