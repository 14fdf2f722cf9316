// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/continued_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <memory>

#include "core/lens/surface_check.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/sample_splines.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

constexpr double kReach = 0.5;
constexpr RunOut kRunOut{0.2};

std::shared_ptr<const OpticalSurface> spline() {
  return std::make_shared<const SplineSurface>(sample_spline());
}

SurfaceShape shape_of(const ControlNet& net, const Eigen::Vector2d& xy) {
  const Eigen::Vector2d size(net.points.row(0).maxCoeff(), net.points.row(1).maxCoeff());
  return net
      .at(net.parameters_of(xy, xy.cwiseQuotient(size).cwiseProduct(net.cells().cast<double>())))
      .shape();
}

/// The mesh moved so that its lower left corner is the origin.
SurfaceMesh at_origin(SurfaceMesh mesh, double reach) {
  mesh.vertices.topRows<2>().array() += reach;
  return mesh;
}

Eigen::Vector2d size_of(const SurfaceMesh& mesh) {
  return mesh.vertices.topRows<2>().rowwise().maxCoeff();
}

TEST(RunOut, HeightAndSlopeAreTheIntegralsOfACurvatureThatRunsOut) {
  double slope = 0.0;
  double height = 0.0;
  constexpr int kSteps = 20000;
  constexpr double kStep = 0.3 / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) * kStep;
    height += (slope + 0.5 * kStep * std::pow(std::max(1.0 - t / 0.2, 0.0), 3)) * kStep;
    slope += std::pow(std::max(1.0 - t / 0.2, 0.0), 3) * kStep;
    if (i % 1000 != 999) continue;
    EXPECT_NEAR(kRunOut.slope(t + 0.5 * kStep), slope, 1e-8);
    EXPECT_NEAR(kRunOut.height(t + 0.5 * kStep), height, 1e-8);
  }
}

TEST(ContinuedSurface, IsTheSameSurfaceOverTheLens) {
  for (const auto& surface : {spline(), optical_surface(noisy_lens(), SurfaceModel::kSmooth),
                              optical_surface(noisy_lens(), SurfaceModel::kFacet)}) {
    const auto whole = continued_surface(surface, kReach, kRunOut);
    EXPECT_EQ(whole->has_creases(), surface->has_creases());
    EXPECT_EQ(whole->mesh().vertices.leftCols(surface->mesh().vertices.cols()),
              surface->mesh().vertices);
    EXPECT_EQ(whole->mesh().triangles.leftCols(surface->mesh().triangles.cols()),
              surface->mesh().triangles);
    const Eigen::Vector3d weights(0.2, 0.3, 0.5);
    for (std::int64_t t = 0; t < surface->mesh().triangle_count(); t += 17) {
      const SurfacePoint a = surface->in_triangle(t, weights);
      const SurfacePoint b = whole->in_triangle(t, weights);
      EXPECT_EQ(a.z, b.z);
      EXPECT_EQ(a.slope, b.slope);
      EXPECT_EQ(surface->bend_range(t).largest, whole->bend_range(t).largest);
    }
  }
}

TEST(ContinuedSurface, CoversARectangleWiderByTheReachOnce) {
  for (const auto& surface : {spline(), optical_surface(noisy_lens(), SurfaceModel::kSmooth),
                              optical_surface(noisy_lens(), SurfaceModel::kFacet)}) {
    const auto whole = continued_surface(surface, kReach, kRunOut);
    const Eigen::Vector2d size = size_of(surface->mesh()) + Eigen::Vector2d::Constant(2.0 * kReach);
    const auto fault = height_field_fault(at_origin(whole->mesh(), kReach), size);
    EXPECT_FALSE(fault) << *fault;
  }
}

/// Heights alone, and the cubics through heights that are kept, are the surface's to the bit.
TEST(ContinuedSurface, HeightsAloneAndInCubicsAreThoseOfItsPoints) {
  const Eigen::Vector3d weights(0.2, 0.3, 0.5);
  const Eigen::Vector3d middle = Eigen::Vector3d::Constant(1.0 / 3.0);
  const auto inner = spline();
  const auto whole = continued_surface(inner, kReach, kRunOut);
  const std::int64_t all = whole->mesh().triangle_count();
  ASSERT_GT(all, inner->mesh().triangle_count());
  for (std::int64_t t = 0; t < all; ++t) {
    EXPECT_EQ(whole->height_in(t, weights), whole->in_triangle(t, weights).z);
    Eigen::Vector2d xy(0.0, 0.0);
    for (int k = 0; k < 3; ++k) xy += whole->mesh().corner(t, k).head<2>() / 3.0;
    EXPECT_NEAR(whole->patch_in(t, middle).at(xy).z, whole->in_triangle(t, middle).z, 1e-13);
  }
}

/// Every side and corner against Taylor's series with the spline's own derivatives.
TEST(ContinuedSurface, BeyondASplineIsItsSeriesWithACurvatureThatRunsOut) {
  const auto surface = spline();
  const ControlNet net = sample_spline();
  const auto whole = continued_surface(surface, kReach, kRunOut);
  const Eigen::Vector2d size = size_of(surface->mesh());
  for (const double t : {0.01, 0.1, 0.3, 0.49}) {
    for (const double at : {0.02, 0.31, 0.5, 0.97}) {
      for (int side = 0; side < 4; ++side) {
        const int axis = side % 2;
        const double sign = side < 2 ? -1.0 : 1.0;
        Eigen::Vector2d rim = at * size;
        rim[axis] = side < 2 ? 0.0 : size[axis];
        Eigen::Vector2d xy = rim;
        xy[axis] += sign * t;
        const SurfaceShape shape = shape_of(net, rim);
        const double bend = shape.bend(axis, axis);
        const auto point = whole->at(xy);
        ASSERT_TRUE(point) << xy.transpose();
        EXPECT_NEAR(point->z, shape.z + sign * t * shape.slope[axis] + kRunOut.height(t) * bend,
                    1e-10);
        EXPECT_NEAR(point->slope[axis], shape.slope[axis] + sign * kRunOut.slope(t) * bend, 1e-9);
      }
    }
  }
}

TEST(ContinuedSurface, StaysTameWhereKnotsCrowdAtACorner) {
  const auto surface = std::make_shared<const SplineSurface>(crowded_spline());
  const auto whole = continued_surface(surface, kReach, kRunOut);
  const auto& inside = surface->mesh().vertices.row(2);
  const auto& heights = whole->mesh().vertices.row(2);
  EXPECT_TRUE(heights.allFinite());
  // Slope and curvature beyond one side and beyond the next add a slope of at most 1 each.
  EXPECT_LT(heights.maxCoeff(), inside.maxCoeff() + 4.0 * kReach);
  EXPECT_GT(heights.minCoeff(), inside.minCoeff() - 4.0 * kReach);
}

TEST(ContinuedSurface, SlopesAreThoseOfTheHeightsAndContinuous) {
  const auto whole = continued_surface(spline(), kReach, kRunOut);
  const Eigen::Vector2d size = size_of(whole->mesh());
  constexpr double kStep = 1e-4;
  // Lines across a side, along one beyond it, and through corners.
  const auto check = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to, double exact) {
    const Eigen::Vector2d way = (to - from).normalized();
    Eigen::Vector2d last(0.0, 0.0);
    for (double s = 2.0 * kStep; s < (to - from).norm() - 2.0 * kStep; s += 0.0037) {
      const Eigen::Vector2d xy = from + s * way;
      const auto here = whole->at(xy);
      const auto before = whole->at(xy - kStep * way);
      const auto after = whole->at(xy + kStep * way);
      ASSERT_TRUE(here && before && after) << xy.transpose();
      EXPECT_NEAR((after->z - before->z) / (2.0 * kStep), way.dot(here->slope), exact)
          << xy.transpose();
      if (s > 2.0 * kStep) {
        EXPECT_LT((here->slope - last).norm(), 0.005) << xy.transpose();
      }
      last = here->slope;
    }
  };
  check({3.0, -kReach}, {3.3, 1.0}, 1e-5);
  check({1.0, -0.3}, {4.0, -0.3}, 1e-5);
  check({-kReach, -kReach}, {1.0, 1.0}, 1e-5);
  check({size.x() - 1.0, -0.4}, {size.x() - 0.01, 1.0}, 1e-5);
  check({-0.45, size.y() - 1.5}, {1.0, size.y() - 0.02}, 1e-5);
}

TEST(ContinuedSurface, FacetsGoOnStraight) {
  const auto whole =
      continued_surface(optical_surface(noisy_lens(), SurfaceModel::kFacet), kReach, kRunOut);
  const Eigen::Matrix3Xd normals = vertex_area_normals(noisy_lens());
  const Eigen::Vector3d corner = noisy_lens().vertices.col(0);
  const Eigen::Vector2d slope = -normals.col(0).head<2>() / normals(2, 0);
  const auto point = whole->at({corner.x() - kReach, corner.y() - kReach});
  ASSERT_TRUE(point);
  EXPECT_NEAR(point->z, corner.z() - kReach * slope.sum(), 1e-12);
}

}  // namespace
}  // namespace lensforge::testing
