// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "core/mesh/surface_mesh.h"
#include "design/graded_mesh.h"
#include "design/random_input.h"
#include "design/schedule/levels.h"

namespace lensforge {
namespace {

const Eigen::Vector2d kSize(24.0, 20.0);
constexpr GridShape kCoarse{17, 16};
constexpr GridShape kFine{33, 31};

double mean_area(const GridShape& shape) {
  return kSize.prod() / (2.0 * (shape.columns - 1) * (shape.rows - 1));
}

/// Border vertices anywhere on the border, the others anywhere within.
SurfaceMesh shuffled_mesh(std::uint64_t seed) {
  testing::Random random(seed);
  SurfaceMesh mesh = make_grid_mesh(kSize, kFine, 5.0);
  for (int v = 0; v < kFine.columns * kFine.rows; ++v) {
    const int column = v % kFine.columns;
    const int row = v / kFine.columns;
    const double x = random.between(0.0, kSize.x());
    const double y = random.between(0.0, kSize.y());
    if (column > 0 && column + 1 < kFine.columns) mesh.vertices(0, v) = x;
    if (row > 0 && row + 1 < kFine.rows) mesh.vertices(1, v) = y;
  }
  return mesh;
}

void expect_border_kept(const SurfaceMesh& mesh) {
  const SurfaceMesh flat = make_grid_mesh(kSize, mesh.grid, 0.0);
  for (int v = 0; v < mesh.grid.columns * mesh.grid.rows; ++v) {
    const int column = v % mesh.grid.columns;
    const int row = v / mesh.grid.columns;
    if (column == 0 || column + 1 == mesh.grid.columns) {
      ASSERT_EQ(mesh.vertices(0, v), flat.vertices(0, v)) << v;
    }
    if (row == 0 || row + 1 == mesh.grid.rows) {
      ASSERT_EQ(mesh.vertices(1, v), flat.vertices(1, v)) << v;
    }
  }
}

TEST(EvenOut, UnfoldsWhatCubicsHaveFoldedOver) {
  int folded = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const SurfaceMesh coarse = testing::graded_mesh(kSize, kCoarse, 0.35, seed);
    SurfaceMesh fine = regrid(coarse, kSize, kFine);
    const bool in_order = testing::projected_areas(coarse).minCoeff() > 0.0;
    if (in_order && testing::projected_areas(fine).minCoeff() <= 0.0) ++folded;
    const double least = 0.02 * mean_area(kFine);
    even_out(least, fine);
    EXPECT_GE(testing::projected_areas(fine).minCoeff(), least);
    expect_border_kept(fine);
  }
  EXPECT_GT(folded, 0) << "no mesh that shows the fault";
}

TEST(EvenOut, EndsOnAnyMeshWithinTheBorder) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    SurfaceMesh mesh = shuffled_mesh(seed);
    const double least = 0.02 * mean_area(kFine);
    even_out(least, mesh);
    EXPECT_GE(testing::projected_areas(mesh).minCoeff(), least);
    expect_border_kept(mesh);
  }
}

TEST(EvenOut, AnEvenMeshStaysWhereItIs) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kFine, 5.0);
  SurfaceMesh mesh = flat;
  even_out(0.02 * mean_area(kFine), mesh);
  // Where the half-cell shift fades vertices are not in the middle of their neighbours.
  const double cell = kSize.x() / (kFine.columns - 1);
  EXPECT_LT((mesh.vertices - flat.vertices).cwiseAbs().maxCoeff(), 0.3 * cell);
  EXPECT_GT(testing::projected_areas(mesh).minCoeff(), 0.6 * mean_area(kFine));
}

TEST(EvenOut, APlaneStaysAPlane) {
  SurfaceMesh mesh = testing::graded_mesh(kSize, kFine, 0.6, 3);
  const auto height = [](const Eigen::Vector3d& p) { return 5.0 + 0.03 * p.x() - 0.02 * p.y(); };
  for (auto p : mesh.vertices.colwise()) p.z() = height(p);
  even_out(0.02 * mean_area(kFine), mesh);
  for (const auto p : mesh.vertices.colwise()) EXPECT_NEAR(p.z(), height(p), 1e-12);
}

}  // namespace
}  // namespace lensforge
