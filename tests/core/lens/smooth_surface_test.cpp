// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/smooth_surface.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <random>
#include <utility>

#include "core/mesh/surface_mesh.h"
#include "core/test_meshes.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

double volume_below(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.corner(t, k);
    const double height = corners.row(2).mean();
    corners.row(2).setOnes();
    volume += 0.5 * corners.determinant() * height;
  }
  return volume;
}

/// A small mesh with uneven cells, heights and slopes that have nothing to do with each other.
struct Contradiction {
  SurfaceMesh mesh = grid_mesh(6, 5);
  Eigen::Matrix2Xd slopes = Eigen::Matrix2Xd(2, mesh.vertex_count());

  Contradiction() {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (double& x : mesh.vertices.reshaped()) x += 0.2 * unit(random);
    for (double& s : slopes.reshaped()) s = unit(random);
  }

  [[nodiscard]] bool is_on_border(int v) const {
    const int column = v % mesh.grid.columns;
    const int row = v / mesh.grid.columns;
    return column == 0 || row == 0 || column + 1 == mesh.grid.columns || row + 1 == mesh.grid.rows;
  }

  /// One row per edge, those that end on the border weighted down; one more holds the mean.
  [[nodiscard]] Eigen::VectorXd dense_solution() const {
    const Eigen::Index n = mesh.vertex_count();
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n * n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n * n);
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int a = std::min(mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t));
        const int b = std::max(mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t));
        const Eigen::Vector2d step = (mesh.vertices.col(b) - mesh.vertices.col(a)).head<2>();
        const double root = is_on_border(a) || is_on_border(b) ? 0.1 : 1.0;  // Of the weight.
        matrix(a * n + b, a) = -root;
        matrix(a * n + b, b) = root;
        right[a * n + b] = root * 0.5 * (slopes.col(a) + slopes.col(b)).dot(step);
      }
    }
    matrix.row(0).setOnes();
    return matrix.colPivHouseholderQr().solve(right);
  }
};

TEST(SlopeHeights, EqualTheDenseLeastSquaresSolution) {
  const Contradiction c;
  const Eigen::VectorXd heights = heights_from_slopes(c.mesh, c.slopes);
  const Eigen::VectorXd dense = c.dense_solution();
  const double shift = heights[0] - dense[0];
  for (Eigen::Index v = 0; v < heights.size(); ++v) {
    EXPECT_NEAR(heights[v], dense[v] + shift, 1e-7) << v;
  }
  SurfaceMesh fitted = c.mesh;
  fitted.vertices.row(2) = heights.transpose();
  EXPECT_NEAR(volume_below(fitted), volume_below(c.mesh), 1e-12);
}

TEST(SlopeHeights, AreTheMeshsOwnWhereSlopesAgreeWithThem) {
  SurfaceMesh mesh = grid_mesh(40, 30, 0.5);
  Eigen::Matrix2Xd slopes(2, mesh.vertex_count());
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    const double x = mesh.vertices(0, v);
    const double y = mesh.vertices(1, v);
    mesh.vertices(2, v) = 5.0 + 0.03 * x * x - 0.02 * x * y + 0.1 * y;
    slopes.col(v) << 0.06 * x - 0.02 * y, -0.02 * x + 0.1;
  }
  const Eigen::VectorXd heights = heights_from_slopes(mesh, slopes);
  EXPECT_LT((heights - mesh.vertices.row(2).transpose()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SlopeHeights, DoNotDependOnWavesOfTheMesh) {
  Contradiction c;
  const Eigen::VectorXd before = heights_from_slopes(c.mesh, c.slopes);
  for (Eigen::Index v = 0; v < c.mesh.vertex_count(); ++v) {
    c.mesh.vertices(2, v) += v % 2 == 0 ? 0.3 : -0.3;
  }
  const Eigen::VectorXd after = heights_from_slopes(c.mesh, c.slopes);
  const Eigen::ArrayXd change = after - before;
  EXPECT_LT((change - change[0]).abs().maxCoeff(), 1e-7);
}

TEST(SmoothSurface, HasTheDesignsNormalsAboveTheVerticesAndHeightsToFit) {
  for (const SurfaceMesh& mesh : {smooth_lens(), creased_lens(), noisy_lens()}) {
    const SmoothSurface surface(mesh);
    const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
    const Eigen::VectorXd heights = heights_from_slopes(mesh, surface.slopes());
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      const auto point = surface.at(mesh.vertices.col(v).head<2>());
      ASSERT_TRUE(point);
      EXPECT_NEAR(point->z, heights[v], 1e-12);
      const Eigen::Vector3d normal(-point->slope.x(), -point->slope.y(), 1.0);
      EXPECT_LT((normal.normalized() - normals.col(v).normalized()).norm(), 1e-10);
    }
  }
}

TEST(SmoothSurface, KeepsAPlane) {
  const SmoothSurface surface(surface_of(
      {10.0, 8.0}, {12, 11}, [](double x, double y) { return 5.0 + 0.3 * x - 0.2 * y; }));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d xy(10.0 * unit(random), 8.0 * unit(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, 5.0 + 0.3 * xy.x() - 0.2 * xy.y(), 1e-12);
    EXPECT_NEAR(point->slope.x(), 0.3, 1e-11);
    EXPECT_NEAR(point->slope.y(), -0.2, 1e-11);
  }
}

/// A paraboloid's slopes at the inner vertices of the even grid are exact, and with exact slopes
/// the reduced Clough–Tocher triangle reproduces quadratics. On the border normals lean inwards,
/// which moves the rest up or down.
TEST(SmoothSurface, KeepsAParaboloidAwayFromTheBorder) {
  const auto height = [](double x, double y) { return 5.0 + 0.01 * x * x + 0.02 * x * y; };
  const SmoothSurface surface(surface_of({24.0, 24.0}, {25, 29}, height));
  const double shift = surface.at({12.0, 12.0})->z - height(12.0, 12.0);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> inside(8.0, 16.0);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d xy(inside(random), inside(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, height(xy.x(), xy.y()) + shift, 1e-3);
    EXPECT_NEAR(point->slope.x(), 0.02 * xy.x() + 0.02 * xy.y(), 3e-4);
    EXPECT_NEAR(point->slope.y(), 0.02 * xy.x(), 3e-4);
  }
}

TEST(SmoothSurface, SlopesAreTheDerivativesOfHeightAndContinuous) {
  const SmoothSurface surface(noisy_lens());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.001, 0.999);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector2d xy(30.0 * unit(random), 24.0 * unit(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    for (const auto& [axis, step] : {std::pair{0, 1e-5}, {0, 5e-6}, {1, 1e-5}, {1, 5e-6}}) {
      const Eigen::Vector2d way = step * Eigen::Vector2d::Unit(axis);
      const auto after = surface.at(xy + way);
      const auto before = surface.at(xy - way);
      ASSERT_TRUE(after && before);
      EXPECT_NEAR((after->z - before->z) / (2.0 * step), point->slope[axis], 1e-6);
      EXPECT_LT((after->slope - before->slope).norm(), 5.0 * step);
    }
  }
}

TEST(SmoothSurface, HasNoPointOffTheMesh) {
  const SmoothSurface surface(smooth_lens());
  EXPECT_FALSE(surface.at({-0.01, 5.0}));
  EXPECT_FALSE(surface.at({5.0, 24.01}));
  EXPECT_TRUE(surface.at({0.0, 0.0}));
  EXPECT_TRUE(surface.at({30.0, 24.0}));
}

}  // namespace

}  // namespace lensforge::testing
