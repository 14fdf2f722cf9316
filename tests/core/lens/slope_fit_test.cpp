// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/slope_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "core/lens/surface_check.h"
#include "core/mesh/surface_mesh.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

const Eigen::Vector2d kSize(30.0, 24.0);
const Eigen::Vector2d kSlope(0.3, -0.2);

/// Bend of a rim, mm: nearly the most that surface_fault() accepts.
constexpr double kBend = 0.9 * kRimShare * 30.0;

double plane(const Eigen::Vector2d& at) { return 5.0 + kSlope.dot(at); }

/// A plane whose four sides are bent inwards between its corners.
SurfaceMesh plane_with_bent_rim() {
  SurfaceMesh mesh = make_grid_mesh(kSize, {31, 29}, 0.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Array2d share = mesh.vertices.col(v).head<2>().cwiseQuotient(kSize);
    const Eigen::Array2d across(share.y(), share.x());
    mesh.vertices.col(v).head<2>().array() +=
        kBend * (std::numbers::pi * across).sin() * (1.0 - 2.0 * share);
    mesh.vertices(2, v) = plane(mesh.vertices.col(v).head<2>());
  }
  return mesh;
}

/// Points of the lens's rim that the mesh leaves out, on all four sides.
std::vector<Eigen::Vector2d> points_on_rim() {
  std::vector<Eigen::Vector2d> points;
  for (const double share : {0.13, 0.5, 0.77}) {
    const Eigen::Vector2d at = share * kSize;
    points.insert(points.end(), {{0.0, at.y()}, {kSize.x(), at.y()}});
    points.insert(points.end(), {{at.x(), 0.0}, {at.x(), kSize.y()}});
  }
  return points;
}

TEST(ModelNear, FindsThePlaneBesideABentRim) {
  const SurfaceMesh mesh = plane_with_bent_rim();
  OpticalSetup setup;
  setup.lens_size = setup.image_size = kSize;
  ASSERT_EQ(surface_fault(mesh, setup), std::nullopt);
  const SmoothSurface surface(mesh);
  // The point taken instead is at most 2 kRimShare of the longer side away.
  const double reach = 2.0 * kRimShare * kSize.maxCoeff() * (1.0 + 1e-9);
  for (const Eigen::Vector2d& at : points_on_rim()) {
    ASSERT_FALSE(surface.model_at(at)) << at.transpose();
    const SurfacePoint point = model_near(surface, at);
    EXPECT_NEAR(point.z, plane(at), reach * kSlope.cwiseAbs().maxCoeff()) << at.transpose();
    EXPECT_LT((point.slope - kSlope).norm(), 1e-9) << at.transpose();
  }
}

TEST(ModelNear, TakesTheNearestPointOfTheBoxForPointsOutside) {
  const SmoothSurface surface(plane_with_bent_rim());
  for (const Eigen::Vector2d& at : points_on_rim()) {
    const Eigen::Vector2d outwards = (at - 0.5 * kSize).cwiseQuotient(kSize);
    Eigen::Index axis = 0;
    outwards.cwiseAbs().maxCoeff(&axis);
    Eigen::Vector2d beyond = at;
    beyond[axis] += std::copysign(1.0, outwards[axis]);
    EXPECT_EQ(model_near(surface, beyond).z, model_near(surface, at).z) << beyond.transpose();
  }
}

TEST(ModelNear, IsTheModelInsideTheMesh) {
  const SmoothSurface surface(noisy_lens());
  for (const double x : {0.0, 0.4, 7.7, 14.2, 29.9}) {
    const Eigen::Vector2d at(x, 0.7 * x + 0.1);
    const auto model = surface.model_at(at);
    ASSERT_TRUE(model) << x;
    const SurfacePoint point = model_near(surface, at);
    EXPECT_EQ(point.z, model->z);
    EXPECT_EQ(point.slope, model->slope);
  }
}

}  // namespace
}  // namespace lensforge::testing
