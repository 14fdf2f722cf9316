// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/optical_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "core/mesh/surface_mesh.h"
#include "core/spline/sample_splines.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

Eigen::Vector3d centroid(const SurfaceMesh& mesh, Eigen::Index triangle) {
  return (mesh.corner(triangle, 0) + mesh.corner(triangle, 1) + mesh.corner(triangle, 2)) / 3.0;
}

TEST(FacetSurface, IsThePlaneOfEachTriangle) {
  const FacetSurface surface(noisy_lens());
  const SurfaceMesh& mesh = surface.mesh();
  EXPECT_EQ(mesh.vertices, noisy_lens().vertices);
  EXPECT_TRUE(surface.has_creases());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3d c = centroid(mesh, t);
    const Eigen::Vector3d normal = area_normal(mesh, t);
    const auto point = surface.at(c.head<2>());
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, c.z(), 1e-13);
    EXPECT_LT((point->slope + normal.head<2>() / normal.z()).norm(), 1e-12);
    const auto patch = surface.patch_at(c.head<2>());
    ASSERT_TRUE(patch);
    const SurfaceShape shape = patch->at(mesh.corner(t, 1).head<2>());
    EXPECT_NEAR(shape.z, mesh.corner(t, 1).z(), 1e-12);
    EXPECT_LT((shape.slope - point->slope).norm(), 1e-11);
    EXPECT_LT(shape.bend.norm(), 1e-9);
  }
}

TEST(OpticalSurface, EveryModelHasPatchesThatEqualIt) {
  for (const SurfaceModel model : kMeshModels) {
    const auto surface = optical_surface(noisy_lens(), model);
    for (const double x : {0.31, 7.77, 14.2, 29.9}) {
      const Eigen::Vector2d q(x, 0.7 * x + 0.05);
      const auto point = surface->at(q);
      const auto patch = surface->patch_at(q);
      ASSERT_TRUE(point && patch) << x;
      EXPECT_NEAR(patch->at(q).z, point->z, 1e-12);
      EXPECT_LT((patch->at(q).slope - point->slope).norm(), 1e-10);
    }
    EXPECT_FALSE(surface->at({-1.0, 2.0}));
    EXPECT_FALSE(surface->patch_at({-1.0, 2.0}));
  }
}

TEST(OpticalSurface, OnlyFacetsHaveCreases) {
  for (const auto& [name, model] : named(kMeshModels)) {
    EXPECT_EQ(optical_surface(smooth_lens(7), model)->has_creases(), name == "facet");
  }
}

TEST(SplineSurface, IsTheSplineAboveEveryPoint) {
  const SplineSurface surface(sample_spline());
  EXPECT_FALSE(surface.has_creases());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const double u = 11.0 * unit(random);
    const SplineFrame frame = surface.net().at({u, 8.0 * unit(random)});
    const auto point = surface.at(frame.point.head<2>());
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, frame.point.z(), 1e-12);
    EXPECT_LT((point->slope - frame.shape().slope).norm(), 1e-11);
  }
  EXPECT_FALSE(surface.at({-0.1, 5.0}));
  EXPECT_FALSE(surface.at({7.0, 10.1}));
}

TEST(SplineSurface, SecondDerivativesAreContinuous) {
  const SplineSurface surface(sample_spline());
  for (double x = 0.05; x < 14.9; x += 0.0317) {
    const auto shape_at = [&](double at) {
      return surface.net()
          .at(surface.net().parameters_of({at, 4.3}, {at / 15.0 * 11.0, 3.4}))
          .shape();
    };
    EXPECT_LT((shape_at(x + 1e-6).bend - shape_at(x).bend).norm(), 1e-5) << x;
  }
}

/// Patches are cubics: four times smaller triangles would have errors some sixty times smaller.
TEST(SplineSurface, PatchesAreTheSurfaceToTheFourthOrder) {
  const SplineSurface surface(sample_spline());
  for (Eigen::Index t = 0; t < surface.mesh().triangle_count(); ++t) {
    const Eigen::Vector3d middle = Eigen::Vector3d::Constant(1.0 / 3.0);
    const SmoothPatch patch = surface.patch_in(t, middle);
    for (const Eigen::Vector3d& weights :
         {Eigen::Vector3d(1.0, 0.0, 0.0), middle, Eigen::Vector3d(0.2, 0.5, 0.3)}) {
      Eigen::Vector2d xy(0.0, 0.0);
      for (int k = 0; k < 3; ++k) xy += weights[k] * surface.mesh().corner(t, k).head<2>();
      const SurfaceShape shape = surface.shape_in(t, weights);
      EXPECT_NEAR(patch.at(xy).z, shape.z, 2e-5);
      EXPECT_LT((patch.at(xy).slope - shape.slope).norm(), 2e-4);
    }
  }
}

TEST(SplineSurface, BendRangesHoldInsideTheirTriangles) {
  const SplineSurface surface(sample_spline());
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  double widest = 0.0;
  for (Eigen::Index t = 0; t < surface.mesh().triangle_count(); ++t) {
    Eigen::Vector3d weights(unit(random), unit(random), unit(random));
    weights /= weights.sum();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(surface.shape_in(t, weights).bend);
    const BendRange range = surface.bend_range(t);
    widest = std::max(widest, range.largest - range.least);
    // What lies between the corners of half a knot cell: a hundredth of the bends of all.
    EXPECT_GE(solver.eigenvalues()[0], range.least - 2e-3) << t;
    EXPECT_LE(solver.eigenvalues()[1], range.largest + 2e-3) << t;
  }
  EXPECT_GT(widest, 0.01);
}

}  // namespace

}  // namespace lensforge::testing
