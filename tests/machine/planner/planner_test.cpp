// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "machine/gcode.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

/// Settings without rounding to steps, so that closed forms hold to rounding.
PlannerSettings smooth_machine() {
  PlannerSettings settings;
  settings.max_rate = {6000.0, 6000.0, 3000.0};
  settings.acceleration = {400.0, 400.0, 200.0};
  settings.steps_per_mm.setZero();
  settings.blocks = 15;
  return settings;
}

/// Drives a model along points, at one feed in mm/min.
class Path {
 public:
  explicit Path(const PlannerSettings& settings, double feed) : model_(settings), feed_(feed) {}

  Path& to(const Vector3d& end) {
    GcodeMotion motion;
    motion.start = at_;
    motion.end = at_ = end;
    motion.feed = feed_;
    motion.rapid = feed_ == 0.0;
    motion.line = ++line_;
    model_.line(20);
    model_.add(motion);
    return *this;
  }
  PlannerModel& model() { return model_; }
  PlanTime finish() { return model_.finish(); }

 private:
  PlannerModel model_;
  double feed_;
  Vector3d at_ = Vector3d::Zero();
  std::int64_t line_ = 0;
};

TEST(PlannerModel, LongPieceIsATrapezoid) {
  // 50 mm at 50 mm/s with 400 mm/s²: d/v + v/a.
  const PlanTime time = Path(smooth_machine(), 3000).to({50, 0, 0}).finish();
  EXPECT_NEAR(time.seconds, 50.0 / 50.0 + 50.0 / 400.0, 1e-12);
  EXPECT_EQ(time.motions, 1);
  EXPECT_DOUBLE_EQ(time.length, 50.0);
}

TEST(PlannerModel, ShortPieceIsATriangle) {
  const PlanTime time = Path(smooth_machine(), 3000).to({1, 0, 0}).finish();
  EXPECT_NEAR(time.seconds, 2.0 * std::sqrt(1.0 / 400.0), 1e-12);
}

TEST(PlannerModel, AxesKeepTheirLimits) {
  // Along (1,0,1)/√2, Z allows √2·50 mm/s and √2·200 mm/s².
  const double root = std::sqrt(2.0);
  const PlanTime time = Path(smooth_machine(), 0).to({60, 0, 60}).finish();
  EXPECT_NEAR(time.seconds, 60.0 * root / (50.0 * root) + 50.0 / 200.0, 1e-12);
}

TEST(PlannerModel, RightAngleIsPassedAtItsJunctionSpeed) {
  PlannerSettings settings = smooth_machine();
  settings.junction_deviation = 0.02;
  // θ = 90°, s = sin 45°; along (−1,1)/√2 both axes give √2·400.
  const double s = std::sqrt(0.5);
  const double corner = std::sqrt(400.0 * std::sqrt(2.0) * 0.02 * s / (1.0 - s));
  const PlanTime time = Path(settings, 3000).to({30, 0, 0}).to({30, 30, 0}).finish();
  const double up = 50.0 / 400.0;
  const double down = (50.0 - corner) / 400.0;
  const double ramps = 0.5 * 50.0 * up + 0.5 * (50.0 + corner) * down;
  EXPECT_NEAR(time.seconds, 2.0 * (up + down + (30.0 - ramps) / 50.0), 1e-12);
}

TEST(PlannerModel, ReversalIsAStandstill) {
  const double one = Path(smooth_machine(), 3000).to({10, 0, 0}).finish().seconds;
  const double both = Path(smooth_machine(), 3000).to({10, 0, 0}).to({0, 0, 0}).finish().seconds;
  EXPECT_NEAR(both, 2.0 * one, 1e-12);
}

TEST(PlannerModel, PiecesInLineRunAsOne) {
  Path path(smooth_machine(), 3000);
  for (int i = 1; i <= 10; ++i) path.to({5.0 * i, 0, 0});
  EXPECT_NEAR(path.finish().seconds, 50.0 / 50.0 + 50.0 / 400.0, 1e-12);
}

/// Endless short pieces in line: behind the running one lie N − 1 of length s, so it ends at
/// v² = 2a(N − 1)s; each goes up and down between: peak² = v² + as.
TEST(PlannerModel, LookAheadLimitsShortPieces) {
  for (const int blocks : {15, 35, 100}) {
    PlannerSettings settings = smooth_machine();
    settings.max_rate.setConstant(60'000.0);
    settings.blocks = blocks;
    const double s = 0.01;
    const auto time_of = [&](int pieces) {
      Path path(settings, 60'000);
      for (int i = 1; i <= pieces; ++i) path.to({s * i, 0, 0});
      return path.finish().seconds;
    };
    const double a = 400.0;
    const double ends = std::sqrt(2.0 * a * (blocks - 1) * s);
    const double peak = std::sqrt(ends * ends + a * s);
    EXPECT_NEAR((time_of(5000) - time_of(3000)) / 2000.0, 2.0 * (peak - ends) / a, 1e-10);
  }
}

/// The fixed point of "no entry faster than its neighbours allow", found by plain repetition.
double slow_reference(const PlannerSettings& settings, const std::vector<Vector3d>& points,
                      double feed) {
  MotionBlocks splitter(settings);
  std::vector<PlanBlock> blocks;
  for (std::size_t i = 1; i < points.size(); ++i) {
    GcodeMotion motion;
    motion.start = points[i - 1];
    motion.end = points[i];
    motion.feed = feed;
    splitter.split(motion, [&](const PlanBlock& block) { blocks.push_back(block); });
  }
  std::vector<double> square(blocks.size() + 1, 0.0);
  for (std::size_t i = 0; i < blocks.size(); ++i) square[i] = blocks[i].max_entry_square;
  for (std::size_t round = 0; round < 2 * blocks.size(); ++round) {
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const double reach = 2.0 * blocks[i].acceleration * blocks[i].length;
      square[i] = std::min(square[i], square[i + 1] + reach);
      square[i + 1] = std::min(square[i + 1], square[i] + reach);
    }
  }
  // Times by integrating ds/v in small steps.
  double seconds = 0.0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const PlanBlock& block = blocks[i];
    const int steps = 4000;
    const double ds = block.length / steps;
    const auto speed_at = [&](double x) {
      const double up = std::sqrt(square[i] + 2.0 * block.acceleration * x);
      const double down = std::sqrt(square[i + 1] + 2.0 * block.acceleration * (block.length - x));
      return std::min({up, down, block.nominal});
    };
    for (int k = 0; k < steps; ++k) {
      seconds += 2.0 * ds / (speed_at(k * ds) + speed_at((k + 1) * ds));
    }
  }
  return seconds;
}

TEST(PlannerModel, AgreesWithASlowReferenceOnRandomPaths) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> step(-3.0, 3.0);
  PlannerSettings settings = smooth_machine();
  settings.blocks = 100;  // holds the whole path, so that the look-ahead has no part in it
  for (int round = 0; round < 20; ++round) {
    std::vector<Vector3d> points{Vector3d::Zero()};
    for (int i = 0; i < 60; ++i) {
      points.emplace_back(points.back() + Vector3d(step(engine), step(engine), step(engine)));
    }
    Path path(settings, 2500);
    for (std::size_t i = 1; i < points.size(); ++i) path.to(points[i]);
    const double expected = slow_reference(settings, points, 2500);
    EXPECT_NEAR(path.finish().seconds, expected, 1e-4 * expected);
  }
}

TEST(PlannerModel, DwellsStopTheMachine) {
  Path path(smooth_machine(), 3000);
  path.to({10, 0, 0});
  path.model().wait(2.5);
  path.to({20, 0, 0});
  const double one = Path(smooth_machine(), 3000).to({10, 0, 0}).finish().seconds;
  EXPECT_NEAR(path.finish().seconds, 2.0 * one + 2.5, 1e-12);
}

TEST(PlannerModel, RoundsToSteps) {
  PlannerSettings settings = smooth_machine();
  settings.steps_per_mm.setConstant(100.0);
  const PlanTime none = Path(settings, 3000).to({0.004, 0, 0}).to({0.0, 0, 0}).finish();
  EXPECT_EQ(none.blocks, 0);
  EXPECT_EQ(none.seconds, 0.0);
  // The first 0.004 is not lost: 0.008 is one step.
  EXPECT_EQ(Path(settings, 3000).to({0.004, 0, 0}).to({0.008, 0, 0}).finish().blocks, 1);
}

TEST(PlannerModel, ArcsAreChordsWithinTheTolerance) {
  for (const double radius : {0.1, 1.0, 10.0, 200.0}) {
    for (const double tolerance : {0.002, 0.02}) {
      const int chords = arc_chords(radius, 2.0 * kPi, tolerance);
      const double sagitta = radius * (1.0 - std::cos(kPi / chords));
      EXPECT_LE(sagitta, 1.5 * tolerance) << radius;  // rounding down costs at most one chord
      const double finer = radius * (1.0 - std::cos(kPi / (chords + 1)));
      EXPECT_LE(finer, 1.01 * tolerance) << radius;
    }
  }
}

TEST(PlannerModel, SlowCircleTakesItsLengthOverItsFeed) {
  ArcRequest request;
  request.offset = {10, 0, 0};
  GcodeMotion motion;
  motion.arc = make_arc({0, 0, 0}, {0, 0, 0}, request).arc;
  motion.feed = 300;
  PlannerModel model(smooth_machine());
  model.line(20);
  model.add(motion);
  const PlanTime time = model.finish();
  EXPECT_GT(time.blocks, 100);
  EXPECT_NEAR(time.seconds, 20.0 * kPi / 5.0 + 5.0 / 400.0, 2e-3 * time.seconds);
}

TEST(PlannerModel, NeedsTheLinesThatItsFeedAsksFor) {
  // 0.1 mm pieces at 50 mm/s are 500 lines a second, at 20 bytes each.
  Path path(smooth_machine(), 1200);
  for (int i = 1; i <= 2000; ++i) path.to({0.1 * i, 0, 0});
  const PlanTime time = path.finish();
  EXPECT_NEAR(time.peak_lines_per_second, 200.0, 1e-6);
  EXPECT_NEAR(time.peak_bytes_per_second, 4000.0, 1e-4);
}

TEST(PlannerModel, FewLinesAskForNoRate) {
  Path path(smooth_machine(), 1200);
  for (int i = 1; i <= 15; ++i) path.to({0.001 * i, 0, 0});
  EXPECT_EQ(path.finish().peak_lines_per_second, 0.0);
}

TEST(PlannerModel, FastEnoughAStreamCostsNothing) {
  PlannerSettings settings = smooth_machine();
  settings.lines_per_second = 2000.0;
  Path path(settings, 1200);
  for (int i = 1; i <= 1000; ++i) path.to({0.1 * i, 0, 0});
  const PlanTime time = path.finish();
  EXPECT_FALSE(time.stream_limited());
  EXPECT_NEAR(time.stream_limited_seconds, time.seconds, 0.05);
  EXPECT_EQ(time.starved, 0);
}

TEST(PlannerModel, StreamSlowerThanTheFeedSetsTheTime) {
  for (const bool by_bytes : {false, true}) {
    PlannerSettings settings = smooth_machine();
    if (by_bytes) settings.bytes_per_second = 20.0 * 50.0;
    if (!by_bytes) settings.lines_per_second = 50.0;
    Path path(settings, 1200);
    for (int i = 1; i <= 1000; ++i) path.to({0.1 * i, 0, 0});
    const PlanTime time = path.finish();
    EXPECT_TRUE(time.stream_limited());
    // Every line comes 20 ms after the one before; the queue never runs far ahead of it.
    EXPECT_NEAR(time.stream_limited_seconds, 1000.0 / 50.0, 0.1);
  }
}

TEST(PlannerModel, StarvedMachineStopsAtEveryLine) {
  PlannerSettings settings = smooth_machine();
  settings.lines_per_second = 5.0;
  Path path(settings, 1200);
  for (int i = 1; i <= 100; ++i) path.to({0.1 * i, 0, 0});
  const PlanTime time = path.finish();
  EXPECT_EQ(time.starved, 99);
  const double last = 2.0 * std::sqrt(0.1 / 400.0);
  EXPECT_NEAR(time.stream_limited_seconds, 100.0 / 5.0 + last, 1e-9);
}

TEST(PlannerModel, TimesAProgramAsTheDoorSays) {
  std::istringstream file("G21 G90\nG1 X100 F600\nM2\n");
  GcodeReader reader(file);
  GcodeInterpreter interpreter(grbl_dialect());
  PlannerModel model(smooth_machine());
  while (const std::optional<GcodeText> text = reader.next()) {
    model.line(text->text.size() + 1);
    const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
    for (const GcodeMotion& motion : effect.motions()) model.add(motion);
  }
  // 100 mm at 10 mm/s, with 400 mm/s² at both ends.
  EXPECT_NEAR(model.finish().seconds, 10.0 + 10.0 / 400.0, 1e-9);
}

TEST(SpeedProfile, NeverBreaksItsLimits) {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int round = 0; round < 500; ++round) {
    const double a = 10.0 + 1000.0 * share(engine);
    const double length = 0.01 + 20.0 * share(engine) * share(engine);
    const double nominal = 1.0 + 100.0 * share(engine);
    const double entry = nominal * share(engine);
    const double low = std::sqrt(std::max(0.0, entry * entry - 2.0 * a * length));
    const double high = std::min(nominal, std::sqrt(entry * entry + 2.0 * a * length));
    const double exit = low + (high - low) * share(engine);
    const SpeedProfile profile(length, entry, exit, nominal, a);
    const int steps = 500;
    const double dt = profile.duration() / steps;
    ProfilePoint last = profile.at(0.0);
    ASSERT_NEAR(last.speed, entry, 1e-9 * nominal);
    for (int i = 1; i <= steps; ++i) {
      const ProfilePoint point = profile.at(i * dt);
      ASSERT_LE(point.speed, nominal * (1.0 + 1e-12));
      ASSERT_LE(std::abs(point.speed - last.speed), a * dt * (1.0 + 1e-6) + 1e-12);
      ASSERT_NEAR(point.distance - last.distance, 0.5 * (point.speed + last.speed) * dt,
                  a * dt * dt + 1e-9);
      last = point;
    }
    ASSERT_NEAR(last.distance, length, 1e-9 * length);
    ASSERT_NEAR(last.speed, exit, 1e-6 * nominal);
  }
}

TEST(PlannerSettings, AreReadFromTheController) {
  std::map<int, double> told{{11, 0.02}, {12, 0.005}};
  for (int axis = 0; axis < 3; ++axis) {
    told[100 + axis] = 800.0;
    told[110 + axis] = 5000.0 + axis;
    told[120 + axis] = 300.0 + axis;
  }
  const PlannerSettings settings = planner_settings(told);
  EXPECT_EQ(settings.junction_deviation, 0.02);
  EXPECT_EQ(settings.max_rate, Vector3d(5000, 5001, 5002));
  EXPECT_EQ(settings.acceleration, Vector3d(300, 301, 302));
  told[121] = 0.0;
  EXPECT_THROW(planner_settings(told), InputError);
  told.erase(121);
  EXPECT_THROW(planner_settings(told), InputError);
}

}  // namespace
}  // namespace lensforge
