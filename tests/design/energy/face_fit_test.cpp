// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "design/energy/smoothness.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

TEST(FaceFit, SolvesAsEigenDoes) {
  testing::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    Eigen::Matrix3d root;
    for (double& x : root.reshaped()) x = random.between(-1.0, 1.0);
    const Eigen::Matrix3d matrix =
        root * root.transpose() + random.magnitude(1e-6, 1.0) * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d right = random.vector3();
    const Eigen::Vector3d expected = matrix.llt().solve(right);
    const double tolerance = 1e-9 * expected.norm();  // Condition numbers of up to 1e7.
    EXPECT_LT((solve_positive(matrix, right) - expected).norm(), tolerance) << matrix;
  }
}

TEST(FaceFit, FindsTheMapThatMadeTheOffsets) {
  testing::Random random(2);
  const WeingartenMap map{0.7, -0.4, 0.2};
  FaceFit fit;
  for (int k = 0; k < 3; ++k) {
    const FaceFrame here{{0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}};
    FaceFrame there = here;
    const Eigen::Vector2d d = random.vector2();
    there.c.head<2>() = d;
    there.n.head<2>() =
        Eigen::Vector2d(map.a * d.x() + map.c * d.y(), map.c * d.x() + map.b * d.y());
    fit.add(NeighbourOffset(here, TangentBasis(here.n), there), 1.0);
  }
  const WeingartenMap found = fit.solve();
  EXPECT_NEAR(found.a, map.a, 1e-7);
  EXPECT_NEAR(found.b, map.b, 1e-7);
  EXPECT_NEAR(found.c, map.c, 1e-7);
}

}  // namespace
}  // namespace lensforge
