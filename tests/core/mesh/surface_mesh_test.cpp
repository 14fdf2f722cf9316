// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/surface_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "design/finite_difference.h"
#include "design/random_corners.h"
#include "design/random_input.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

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

const Eigen::Vector2d kSize(80.0, 60.0);

const std::vector<GridShape>& shapes() {
  static const std::vector<GridShape> all{{2, 2}, {3, 5}, {9, 8}, {41, 36}, {40, 35}};
  return all;
}

double signed_area(const SurfaceMesh& mesh, Eigen::Index t) {
  const Eigen::Vector3d a = mesh.corner(t, 1) - mesh.corner(t, 0);
  const Eigen::Vector3d b = mesh.corner(t, 2) - mesh.corner(t, 0);
  return 0.5 * a.cross(b).z();
}

TEST(GridMesh, TrianglesFaceUpwardsAndTileTheRectangle) {
  for (const GridShape& shape : shapes()) {
    const SurfaceMesh mesh = make_grid_mesh(kSize, shape, 5.0);
    double sum = 0.0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      EXPECT_GT(signed_area(mesh, t), 0.0);
      sum += signed_area(mesh, t);
    }
    EXPECT_NEAR(sum, kSize.prod(), 1e-9);
  }
}

TEST(GridMesh, IsAConnectedManifoldOfTheShapeItSays) {
  for (const GridShape& shape : shapes()) {
    const SurfaceMesh mesh = make_grid_mesh(kSize, shape, 5.0);
    EXPECT_EQ(mesh.grid, shape);
    EXPECT_EQ(mesh.vertex_count(), shape.columns * shape.rows);
    EXPECT_EQ(mesh.triangle_count(), 2 * (shape.columns - 1) * (shape.rows - 1));
    const MeshTopology topology = make_topology(mesh);
    const auto boundary = std::count(topology.on_boundary.begin(), topology.on_boundary.end(), 1);
    EXPECT_EQ(boundary, 2 * (shape.columns + shape.rows) - 4);
  }
}

TEST(GridMesh, BordersAreExact) {
  for (const GridShape& shape : shapes()) {
    const SurfaceMesh mesh = make_grid_mesh(kSize, shape, 5.0);
    for (int v = 0; v < shape.columns * shape.rows; ++v) {
      const int column = v % shape.columns;
      const int row = v / shape.columns;
      EXPECT_EQ(mesh.vertices(0, v) == 0.0, column == 0);
      EXPECT_EQ(mesh.vertices(0, v) == kSize.x(), column == shape.columns - 1);
      EXPECT_EQ(mesh.vertices(1, v) == 0.0, row == 0);
      EXPECT_EQ(mesh.vertices(1, v) == kSize.y(), row == shape.rows - 1);
      EXPECT_EQ(mesh.vertices(2, v), 5.0);
    }
  }
}

TEST(GridMesh, InnerTrianglesAreNearlyEquilateral) {
  const SurfaceMesh mesh = make_grid_mesh({80.0, 80.0}, {41, 47}, 5.0);
  int checked = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    double shortest = 1e9;
    double longest = 0.0;
    bool inner = true;
    for (int k = 0; k < 3; ++k) {
      const double side = (mesh.corner(t, k) - mesh.corner(t, (k + 1) % 3)).norm();
      shortest = std::min(shortest, side);
      longest = std::max(longest, side);
      const int column = mesh.triangles(k, t) % 41;
      inner = inner && column >= kShiftFade && column <= 40 - kShiftFade;
    }
    if (!inner) continue;
    ++checked;
    EXPECT_LT(longest / shortest, 1.01);
  }
  EXPECT_GT(checked, 2500);
}

TEST(Regrid, FlatStaysFlat) {
  const SurfaceMesh coarse = make_grid_mesh(kSize, {11, 9}, 5.0);
  for (const GridShape& shape : {GridShape{21, 17}, GridShape{34, 29}, GridShape{7, 5}}) {
    const SurfaceMesh fine = regrid(coarse, kSize, shape);
    const SurfaceMesh flat = make_grid_mesh(kSize, shape, 5.0);
    EXPECT_EQ(fine.grid, shape);
    EXPECT_EQ(fine.triangles, flat.triangles);
    EXPECT_LT((fine.vertices - flat.vertices).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Regrid, ReproducesLinearFields) {
  SurfaceMesh mesh = make_grid_mesh(kSize, {21, 19}, 0.0);
  const auto height = [](double x, double y) { return 5.0 + 0.03 * x - 0.02 * y; };
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(2, v) = height(mesh.vertices(0, v), mesh.vertices(1, v));
  }
  const SurfaceMesh fine = regrid(mesh, kSize, {41, 37});
  double worst = 0.0;
  for (Eigen::Index v = 0; v < fine.vertices.cols(); ++v) {
    const double error =
        std::fabs(fine.vertices(2, v) - height(fine.vertices(0, v), fine.vertices(1, v)));
    // Near the left and right border the half-cell shift fades: cells of unequal width, on which
    // the cubics are not exact.
    const double column = static_cast<double>(v % 41) / 2.0;
    const bool faded = std::min(column, 20.0 - column) < kShiftFade + 2;
    if (!faded) worst = std::max(worst, error);
    EXPECT_LT(error, 0.03 * 0.1 * kSize.x() / 20.0);
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(Regrid, IsExactAtTheVerticesOfTheOldGrid) {
  testing::Random random(1);
  SurfaceMesh mesh = make_grid_mesh(kSize, {21, 19}, 5.0);
  for (double& z : mesh.vertices.row(2)) z += random.between(-0.1, 0.1);
  const SurfaceMesh same = regrid(mesh, kSize, {21, 19});
  EXPECT_LT((same.vertices - mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Regrid, BorderVerticesStayOnTheBorder) {
  testing::Random random(2);
  SurfaceMesh mesh = make_grid_mesh(kSize, {11, 9}, 5.0);
  for (double& x : mesh.vertices.reshaped()) x += random.between(-1.0, 1.0);
  const SurfaceMesh fine = regrid(mesh, kSize, {21, 17});
  for (int v = 0; v < 21 * 17; ++v) {
    const bool on_x = v % 21 == 0 || v % 21 == 20;
    const bool on_y = v / 21 == 0 || v / 21 == 16;
    EXPECT_EQ(fine.vertices(0, v) == (v % 21 == 0 ? 0.0 : kSize.x()), on_x) << v;
    EXPECT_EQ(fine.vertices(1, v) == (v / 21 == 0 ? 0.0 : kSize.y()), on_y) << v;
  }
}

}  // namespace

}  // namespace lensforge::testing
