// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/surface_projection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "design/finite_difference.h"
#include "design/random_corners.h"
#include "design/random_input.h"
#include "design/snell.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::random_corners;

const LightPath kLight(testing::setup_of({100.0, 80.0}, {50, 40}, 300.0));

TEST(Facet, AllCornersTakeTheSameSlope) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = area_normal(t).normalized();
    const ImageTriangle image = project_facet(t, kLight.facet_beam(t, n), kLight);
    const Eigen::Vector2d m = testing::slope_by_angles(n, 1.49);
    const auto lands = [&](const Eigen::Vector3d& v) -> Eigen::Vector2d {
      const Eigen::Vector2d mm = v.head<2>() + (300.0 - v.z()) * m;
      return {(100.0 - mm.x()) / 2.0, (80.0 - mm.y()) / 2.0};
    };
    EXPECT_LT((image.p0 - lands(t.v0)).norm(), 1e-10);
    EXPECT_LT((image.p1 - lands(t.v1)).norm(), 1e-10);
    EXPECT_LT((image.p2 - lands(t.v2)).norm(), 1e-10);
  }
}

TEST(Facet, FluxIsTheShareOfTheEntryFace) {
  const Corners t{{10.0, 10.0, 5.0}, {20.0, 10.0, 6.0}, {10.0, 14.0, 5.5}};
  const Eigen::Vector3d normal = area_normal(t);
  const ImageTriangle image = project_facet(t, kLight.facet_beam(t, normal.normalized()), kLight);
  EXPECT_NEAR(image.flux, 20.0 / 8000.0, 1e-17);
}

TEST(Facet, TooSteepAFacetIsDark) {
  const Corners t{{10.0, 10.0, 5.0}, {11.0, 10.0, 7.0}, {10.0, 11.0, 5.0}};
  const Eigen::Vector3d normal = area_normal(t);
  ASSERT_LT(normal.normalized().z(), std::cos(std::asin(1.0 / 1.49)));
  EXPECT_FALSE(kLight.transmits(t, normal.normalized()));
}

TEST(Facet, ProjectAdjointEqualsCentralDifferences) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = area_normal(t).normalized();
    const ImageTriangle bar{random.vector2(), random.vector2(), random.vector2(), 0.0};
    Eigen::VectorXd x(12);
    x << testing::pack(t), n;
    const auto f = [&](const Eigen::VectorXd& at) {
      const Corners moved = testing::unpack_corners(at.head<9>());
      const ImageTriangle image =
          project_facet(moved, kLight.facet_beam(moved, at.tail<3>()), kLight);
      return bar.p0.dot(image.p0) + bar.p1.dot(image.p1) + bar.p2.dot(image.p2);
    };
    Corners grad;
    const Eigen::Vector3d n_bar =
        project_facet_adjoint(t, n, kLight.facet_beam(t, n), kLight, bar, grad);
    Eigen::VectorXd computed(12);
    computed << testing::pack(grad), n_bar;
    EXPECT_LT(testing::plateau_error(computed, f, x, 3e-4), 1e-8);
  }
}

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
