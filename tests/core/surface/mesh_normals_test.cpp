// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/mesh/surface_mesh.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

TEST(MeshNormals, OfVerticesAreTheSumsOfTheirTriangles) {
  const SurfaceMesh mesh = smooth_lens(7);
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      if ((mesh.triangles.col(t).array() != static_cast<int>(v)).all()) continue;
      const Eigen::Vector3d a = mesh.corner(t, 0);
      sum += (mesh.corner(t, 1) - a).cross(mesh.corner(t, 2) - a);
    }
    EXPECT_LT((normals.col(v) - sum).norm(), 1e-14);
  }
}

TEST(SurfaceMesh, PlanAreaIsHalfTheAreaNormalsHeightToTheBit) {
  const SurfaceMesh mesh = noisy_lens();
  double sum = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    EXPECT_EQ(mesh.plan_area(t), 0.5 * area_normal(mesh, t).z());
    sum += mesh.plan_area(t);
  }
  const Eigen::Vector2d size = mesh.vertices.topRows<2>().rowwise().maxCoeff();
  EXPECT_NEAR(sum, size.prod(), 1e-10);
}

TEST(SurfaceMesh, PlanAreaOfAClockwiseTriangleIsNegative) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0.0, 0.0, 3.0, 0.0, 4.0, 0.0, 1.0, 9.0, 2.0;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  EXPECT_EQ(mesh.plan_area(0), -6.0);
}

}  // namespace
}  // namespace lensforge::testing
