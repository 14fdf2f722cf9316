// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_paths.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cam/milled/milled_field.h"
#include "cam/milled_paths.h"

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

TEST(FinishPaths, ArcsAlongTheAxisBecomeEllipses) {
  const auto motion = testing::arc_motion(ArcPlane::kYZ, false, {1, 2, 0}, {1, 4, 0}, {0, 1, 1.5});
  BallPath path(kRadius, 0.0);
  add_stretched(motion, kStretch, path);
  const Arc& arc = *motion.arc;
  ASSERT_GT(path.moves().size(), 100U);
  for (const BallMove& move : path.moves()) {
    EXPECT_EQ(move.arc, -1);
    for (const double share : {0.0, 0.5, 1.0}) {
      const Eigen::Vector3d tip =
          move.start + share * (move.end - move.start) - Eigen::Vector3d(0, 0, kRadius);
      const Eigen::Vector2d off(tip.y() / kStretch.factor - arc.centre.y(),
                                tip.z() - arc.centre.z());
      EXPECT_NEAR(off.norm(), arc.radius, 1.01 * BallPath::kHelixError);
    }
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
