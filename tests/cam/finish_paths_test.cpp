// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cam/milled/milled_field.h"
#include "cam/milled_paths.h"
#include "cam/plan/finishing.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;
constexpr AxisStretch kStretch{1, 1.01};

GcodeMotion straight(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  GcodeMotion motion;
  motion.start = start;
  motion.end = end;
  return motion;
}

TEST(FinishPaths, AMachineWithoutPitchErrorMakesTheWaysAsWritten) {
  const AxisStretch none = AxisStretch::of(FinishProcess{});
  EXPECT_FALSE(none.any());
  BallPath written(kRadius, 0.0);
  BallPath made(kRadius, 0.0);
  const auto arc = testing::arc_motion(ArcPlane::kYZ, false, {0, 0, 0}, {0, 1, 0}, {0, 0.5, 1});
  written.add(arc);
  add_stretched(arc, none, made);
  ASSERT_EQ(made.moves().size(), written.moves().size());
  EXPECT_EQ(made.moves().back().end, written.moves().back().end);
  EXPECT_GE(made.moves().back().arc, 0);
}

TEST(FinishPaths, TheErrorIsAcrossThePasses) {
  FinishProcess finish;
  finish.pitch_error = -0.002;
  EXPECT_EQ(AxisStretch::of(finish).axis, 1);
  EXPECT_EQ(AxisStretch::of(finish).factor, 0.998);
  finish.along = PassAxis::kY;
  EXPECT_EQ(AxisStretch::of(finish).axis, 0);
}

TEST(FinishPaths, RowsAndTheirArcsAreMovedAsAWhole) {
  BallPath path(kRadius, 0.0);
  add_stretched(straight({0, 2, -0.1}, {3, 2, -0.2}), kStretch, path);
  add_stretched(testing::arc_motion(ArcPlane::kZX, false, {3, 2, -0.2}, {4, 2, -0.2}, {0.5, 0, 2}),
                kStretch, path);
  EXPECT_EQ(path.moves()[0].start, Eigen::Vector3d(0, 2.02, kRadius - 0.1));
  EXPECT_EQ(path.moves()[0].end, Eigen::Vector3d(3, 2.02, kRadius - 0.2));
  for (std::size_t i = 1; i < path.moves().size(); ++i) EXPECT_GE(path.moves()[i].arc, 0) << i;
  EXPECT_NEAR((path.moves().back().end - Eigen::Vector3d(4, 2.02, kRadius - 0.2)).norm(), 0.0,
              1e-12);
}

/// Every point of the ways stretched back is on the arc, and neighbours meet.
void expect_ellipse(const GcodeMotion& motion, const AxisStretch& stretch, std::size_t most) {
  BallPath path(kRadius, 0.0);
  add_stretched(motion, stretch, path);
  EXPECT_LE(path.moves().size(), most);
  const Arc& arc = *motion.arc;
  for (const BallMove& move : path.moves()) {
    ASSERT_GE(move.arc, 0);
    const Arc& part = path.arcs()[static_cast<std::size_t>(move.arc)];
    for (int k = 0; k <= 8; ++k) {
      Eigen::Vector3d tip = part.at(k / 8.0) - Eigen::Vector3d(0, 0, kRadius);
      tip[stretch.axis] /= stretch.factor;
      EXPECT_NEAR((tip - arc.centre).norm(), arc.radius, 1.1e-6);
    }
  }
  for (std::size_t i = 1; i < path.moves().size(); ++i) {
    EXPECT_NEAR((path.moves()[i].start - path.moves()[i - 1].end).norm(), 0.0, 1e-9);
  }
  Eigen::Vector3d end = motion.end + Eigen::Vector3d(0, 0, kRadius);
  end[stretch.axis] *= stretch.factor;
  EXPECT_NEAR((path.moves().back().end - end).norm(), 0.0, 1e-9);
}

TEST(FinishPaths, ArcsAlongTheAxisBecomeEllipses) {
  for (const double share : {-0.02, -0.001, 0.0005, 0.02}) {
    const AxisStretch y{1, 1.0 + share};
    const AxisStretch x{0, 1.0 + share};
    for (const bool clockwise : {false, true}) {
      const auto arc = [&](ArcPlane plane, const Eigen::Vector3d& end, const Eigen::Vector3d& off) {
        return testing::arc_motion(plane, clockwise, {2, 2, 0}, end, off);
      };
      expect_ellipse(arc(ArcPlane::kYZ, {2, 4, 0}, {0, 1, 0}), y, 60);
      expect_ellipse(arc(ArcPlane::kZX, {4, 2, 0}, {1, 0, 0}), x, 60);
    }
    // A move of a finishing row: a millimetre of a radius of 40 mm.
    const double down = -std::sqrt(40.0 * 40.0 - 0.25);
    const auto row = testing::arc_motion(ArcPlane::kYZ, true, {1, 2, 0}, {1, 3, 0}, {0, 0.5, down});
    ASSERT_LT(std::abs(row.arc->sweep), 0.03);
    expect_ellipse(row, y, 2);
  }
}

TEST(FinishPaths, AHelixIsStretchedToo) {
  auto helix = testing::arc_motion(ArcPlane::kXY, false, {1, 0, 0}, {-1, 0, 0}, {-1, 0, 0});
  helix.end.z() = -0.5;
  helix.arc->rise = -0.5;
  BallPath path(kRadius, 0.0);
  add_stretched(helix, kStretch, path);
  for (const BallMove& move : path.moves()) {
    const Eigen::Vector2d place(move.end.x(), move.end.y() / kStretch.factor);
    EXPECT_NEAR(place.norm(), 1.0, 3e-6);
    const double turn = std::atan2(place.y(), place.x()) / std::numbers::pi;
    EXPECT_NEAR(move.end.z() - kRadius, -0.5 * turn, 1e-3);
  }
}

/// Heights of what a program of rows on a tilted plane leaves, at one place of each of two rows.
TEST(FinishPaths, ThePartIsLongerByTheError) {
  BallPath written(kRadius, 0.0);
  BallPath made(kRadius, 0.0);
  for (int row = 0; row <= 100; ++row) {
    const double y = 0.05 * row;
    const GcodeMotion motion = straight({0, y, 0.1 * y}, {1, y, 0.1 * y});
    written.add(motion);
    add_stretched(motion, kStretch, made);
  }
  const MilledField as_written({written}, 5.0);
  const MilledField as_made({made}, 5.0);
  SurfacePatch one;
  SurfacePatch other;
  for (const int row : {40, 80}) {
    const double y = 0.05 * row;
    as_written.sample({{0.5, y}, {0.01, 0.01}, 1, 1}, Executor::serial(), one);
    as_made.sample({{0.5, 1.01 * y}, {0.01, 0.01}, 1, 1}, Executor::serial(), other);
    EXPECT_NEAR(other.z[0], one.z[0], 1e-5);
    EXPECT_NEAR(one.z[0], 0.1 * y, 1.1e-3);  // The ball on a slope, and the scallop.
  }
}

}  // namespace
}  // namespace lensforge
