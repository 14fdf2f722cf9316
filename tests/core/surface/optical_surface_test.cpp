// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/optical_surface.h"

#include <gtest/gtest.h>

#include "core/mesh/surface_mesh.h"
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

}  // namespace
}  // namespace lensforge::testing
