// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "cam/path/row_fit.h"

namespace lensforge::row_joints_test {
namespace {

/// A wave between level ends, as a polyline with a joint at each node.
RowProfile wave_profile(double spacing) {
  RowProfile profile;
  const auto add = [&](double u, double z) {
    profile.u.push_back(u);
    profile.z.push_back(z);
    profile.joints.push_back(u);
  };
  const auto height = [](double u) { return 3.0 + 0.1 * std::sin(2.0 * u + 0.3); };
  add(-0.2, height(0.0));
  for (int i = 0; i * spacing <= 3.0; ++i) add(i * spacing, height(i * spacing));
  add(3.2, profile.z.back());
  return profile;
}

TEST(RowJoints, LieOnTheCurveAndOnTheGrid) {
  const RowProfile profile = wave_profile(0.002);
  for (const auto& [resolution, share] :
       {std::pair(1e-6, 0.95), std::pair(1e-5, 0.95), std::pair(1e-4, 0.6)}) {
    const ProgramGrid grid{resolution, 1.2345678};
    const RowJoints joints = row_joints(profile, grid);
    ASSERT_EQ(joints.written.size(), joints.exact.size());
    std::size_t near = 0;
    std::size_t hint = 0;
    for (std::size_t i = 0; i < joints.written.size(); ++i) {
      const Eigen::Vector2d& written = joints.written[i];
      EXPECT_EQ(written.x(), grid.place(written.x()));
      EXPECT_EQ(written.y(), grid.height(written.y()));
      EXPECT_EQ(joints.height[i], profile.at(written.x(), hint));
      EXPECT_NEAR(joints.exact[i].x(), written.x(), 0.5001 * resolution);
      EXPECT_EQ(joints.exact[i].y(), profile.at(joints.exact[i].x(), hint));
      if (i > 0) {
        EXPECT_GT(written.x(), joints.written[i - 1].x());
      }
      if (std::abs(written.y() - joints.height[i]) <= 0.1 * resolution) ++near;
    }
    // All but those near the wave's crests, where heights hardly change, and the corners.
    EXPECT_GE(static_cast<double>(near), share * static_cast<double>(joints.written.size()))
        << resolution;
  }
}

/// A corner that is cut off turns the path by its whole angle.
TEST(RowJoints, StayAtCorners) {
  RowProfile profile;
  for (int i = 0; i <= 200; ++i) {
    const double u = 0.00501 * i;
    profile.u.push_back(u);
    profile.z.push_back(3.0 + 0.2 * std::abs(u - 0.501));
    profile.joints.push_back(u);
  }
  const RowJoints joints = row_joints(profile, {});
  const auto corner = std::find_if(joints.exact.begin(), joints.exact.end(),
                                   [](const auto& p) { return std::abs(p.x() - 0.501) < 1e-3; });
  ASSERT_NE(corner, joints.exact.end());
  EXPECT_NEAR(corner->x(), 0.501, 2e-6);
}

TEST(RowJoints, LevelEndsKeepTheCurveAndBeginOnTheGrid) {
  const ProgramGrid grid{1e-5, 0.0};
  const RowProfile profile = wave_profile(0.00173);
  RowProfile levelled = profile;
  level_ends(grid, levelled);
  EXPECT_EQ(levelled.u.front(), profile.u.front());
  EXPECT_EQ(levelled.u.back(), profile.u.back());
  const double begin = levelled.u[1];
  const double end = levelled.u[levelled.u.size() - 2];
  EXPECT_NEAR(begin, 0.0, 1e-3);
  EXPECT_NEAR(end, profile.joints[profile.joints.size() - 2], 1e-3);
  for (const double place : {begin, end}) {
    std::size_t hint = 0;
    EXPECT_EQ(place, grid.place(place));
    EXPECT_NEAR(levelled.at(place, hint), grid.height(levelled.at(place, hint)), 1e-6);
  }
  std::size_t hint = 0;
  std::size_t other = 0;
  for (double u = begin; u <= end; u += 0.0007) {
    EXPECT_NEAR(levelled.at(u, hint), profile.at(u, other), 1e-12);
  }
  EXPECT_EQ(levelled.z.front(), levelled.z[1]);
  EXPECT_EQ(levelled.z.back(), levelled.z[levelled.z.size() - 2]);
  EXPECT_TRUE(std::is_sorted(levelled.joints.begin(), levelled.joints.end()));
}

}  // namespace
}  // namespace lensforge::row_joints_test
