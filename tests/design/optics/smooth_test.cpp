// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/finite_difference.h"
#include "design/flux/surface_projection.h"
#include "design/random_input.h"
#include "design/snell.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;

const LightPath kLight(testing::setup_of({100.0, 80.0}, {50, 40}, 300.0));

TEST(Smooth, VertexNormalIsAUnitVectorAndItsLength) {
  const VertexNormal normal(Eigen::Vector3d(3.0, 0.0, 4.0));
  EXPECT_DOUBLE_EQ(normal.length, 5.0);
  EXPECT_LT((normal.n - Eigen::Vector3d(0.6, 0.0, 0.8)).norm(), 1e-15);
}

TEST(Smooth, VertexSendsItsRayByItsOwnNormal) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = random.near_z(0.6);
    const Eigen::Vector3d p = Eigen::Vector3d(50.0, 40.0, 6.0) + 5.0 * random.vector3();
    const Eigen::Vector2d mm = p.head<2>() + (300.0 - p.z()) * testing::slope_by_angles(n, 1.49);
    const Eigen::Vector2d expected((100.0 - mm.x()) / 2.0, (80.0 - mm.y()) / 2.0);
    EXPECT_LT((project_vertex(p, n, kLight) - expected).norm(), 1e-10);
  }
}

TEST(Smooth, ProjectAdjointEqualsCentralDifferences) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd x(6);
    x << Eigen::Vector3d(50.0, 40.0, 6.0) + 5.0 * random.vector3(), random.near_z(0.6);
    const Eigen::Vector2d u_bar = random.vector2();
    const auto f = [&](const Eigen::VectorXd& at) {
      return u_bar.dot(project_vertex(at.head<3>(), at.tail<3>(), kLight));
    };
    Eigen::Vector3d p_bar(0.0, 0.0, 0.0);
    const Eigen::Vector3d n_bar =
        project_vertex_adjoint(x.head<3>(), x.tail<3>(), kLight, u_bar, p_bar);
    Eigen::VectorXd computed(6);
    computed << p_bar, n_bar;
    EXPECT_LT(testing::plateau_error(computed, f, x, 3e-4), 1e-8);
  }
}

}  // namespace
}  // namespace lensforge
