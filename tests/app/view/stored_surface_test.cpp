// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "app/view/lens_view.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {
namespace {

const Eigen::Vector2d kSize(30.0, 20.0);

SurfaceMesh bumps() {
  SurfaceMesh mesh = make_grid_mesh(kSize, {31, 24}, 4.0);
  for (auto p : mesh.vertices.colwise()) {
    p.z() += 0.3 * std::sin(0.4 * p.x()) * std::cos(0.3 * p.y());
  }
  return mesh;
}

TEST(StoredSurface, IsReadBackToHalfAStep) {
  const SurfaceMesh mesh = bumps();
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  const StoredSurface stored = store_surface(mesh, normals, kSize);
  const char* const names[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const double off =
        (stored.read_back.mesh.vertices - mesh.vertices).row(axis).cwiseAbs().maxCoeff();
    EXPECT_LE(off, 0.5001 * stored.channel(names[axis])->step() + 1e-12) << names[axis];
  }
  EXPECT_LT(stored.channel("z")->step(), 1e-7);
  EXPECT_LT(stored.channel("x")->step(), 2e-5);
  const Eigen::Matrix3Xd& kept = stored.read_back.normals;
  for (Eigen::Index v = 0; v < kept.cols(); ++v) {
    EXPECT_NEAR(kept(0, v) / kept(2, v), normals(0, v) / normals(2, v),
                0.51 * stored.channel("slope_x")->step());
    EXPECT_NEAR(kept(1, v) / kept(2, v), normals(1, v) / normals(2, v),
                0.51 * stored.channel("slope_y")->step());
  }
}

TEST(StoredSurface, FacetsHaveNoSlopes) {
  const StoredSurface stored = store_surface(bumps(), {}, kSize);
  EXPECT_EQ(stored.channel("slope_x"), nullptr);
  EXPECT_EQ(stored.read_back.normals.cols(), 0);
}

TEST(StoredSurface, TrianglesFollowFromAGridAndAreStoredWithoutOne) {
  SurfaceMesh mesh = bumps();
  EXPECT_TRUE(store_surface(mesh, {}, kSize).zigzag);
  EXPECT_TRUE(store_surface(mesh, {}, kSize).corners.empty());
  mesh.triangles = grid_triangles(mesh.grid);
  EXPECT_FALSE(store_surface(mesh, {}, kSize).zigzag);
  EXPECT_TRUE(store_surface(mesh, {}, kSize).corners.empty());
  mesh.grid = {};
  EXPECT_FALSE(store_surface(mesh, {}, kSize).corners.empty());
}

TEST(StoredSurface, AnEvenGridNeedsNoPlaces) {
  SurfaceMesh mesh = bumps();
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(0, v) = kSize.x() * static_cast<double>(v % mesh.grid.columns) / 30;
  }
  const StoredSurface stored = store_surface(mesh, {}, kSize);
  EXPECT_EQ(stored.channel("x")->bytes, 0);
  EXPECT_EQ(stored.channel("x")->text, "");
  EXPECT_EQ(stored.channel("y")->bytes, 0);
}

}  // namespace
}  // namespace lensforge
