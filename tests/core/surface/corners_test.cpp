// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/mesh/surface_mesh.h"
#include "design/finite_difference.h"
#include "design/random_corners.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::random_corners;

TEST(Corners, AreaNormalIsTwiceTheAreaLong) {
  const Corners t{{0.0, 0.0, 2.0}, {3.0, 0.0, 2.0}, {0.0, 4.0, 2.0}};
  EXPECT_EQ(area_normal(t), Eigen::Vector3d(0.0, 0.0, 12.0));
}

TEST(Corners, CrossIsPositiveCounterClockwise) {
  EXPECT_EQ(cross({3.0, 0.0}, {1.0, 4.0}), 12.0);
  EXPECT_EQ(cross({1.0, 4.0}, {3.0, 0.0}), -12.0);
}

TEST(Corners, AreaNormalAdjointEqualsCentralDifferences) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d bar = random.vector3();
    const auto f = [&](const Eigen::VectorXd& x) {
      return bar.dot(area_normal(testing::unpack_corners(x)));
    };
    Corners grad;
    area_normal_adjoint(t, bar, grad);
    EXPECT_LT(testing::plateau_error(testing::pack(grad), f, testing::pack(t), 1e-2), 1e-9);
  }
}

TEST(Corners, NormalizeAdjointEqualsCentralDifferences) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d whole = random.magnitude(1e-3, 1e3) * random.near_z(3.0);
    const Eigen::Vector3d bar = random.vector3();
    const double length = whole.norm();
    const auto f = [&](const Eigen::VectorXd& x) { return bar.dot(x.normalized()); };
    const Eigen::VectorXd computed = normalize_adjoint(whole / length, length, bar);
    EXPECT_LT(testing::plateau_error(computed, f, whole, 1e-3 * length), 1e-9);
  }
}

}  // namespace
}  // namespace lensforge
