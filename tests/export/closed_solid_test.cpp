// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/files/closed_solid.h"

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <utility>

#include "core/error.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

/// Every edge is walked exactly once in each direction.
void expect_watertight(const SurfaceMesh& solid) {
  std::map<std::pair<int, int>, int> walked;
  for (Eigen::Index t = 0; t < solid.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++walked[{solid.triangles(k, t), solid.triangles((k + 1) % 3, t)}];
    }
  }
  for (const auto& [edge, count] : walked) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(walked.contains({edge.second, edge.first}));
  }
}

/// Volume below the surface: flat area times mean height, triangle by triangle.
double volume_below(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3d u = mesh.corner(t, 1) - mesh.corner(t, 0);
    const Eigen::Vector3d v = mesh.corner(t, 2) - mesh.corner(t, 0);
    const double z = mesh.corner(t, 0).z() + mesh.corner(t, 1).z() + mesh.corner(t, 2).z();
    volume += 0.5 * (u.x() * v.y() - u.y() * v.x()) * z / 3.0;
  }
  return volume;
}

TEST(ClosedSolid, IsWatertightAndFacesOutwards) {
  for (const SurfaceMesh& mesh : {smooth_lens(), creased_lens(), noisy_lens(), grid_mesh(2, 2)}) {
    const SurfaceMesh solid = closed_solid(mesh, "lens");
    expect_watertight(solid);
    EXPECT_NEAR(enclosed_volume(solid), volume_below(mesh), 1e-9 * volume_below(mesh));
    EXPECT_EQ(solid.triangles.leftCols(mesh.triangle_count()), mesh.triangles);
  }
}

TEST(ClosedSolid, HasItsCurvedFront) {
  const SurfaceMesh mesh = smooth_lens(81);
  const SphericalFront front{60.0, {10.0, 10.0, -2.0}};
  const SurfaceMesh solid = closed_solid(mesh, "lens", front);
  expect_watertight(solid);
  // Below z = 0, by the midpoint rule.
  constexpr int kCells = 400;
  double below = 0.0;
  const Eigen::Vector2d size = mesh.vertices.topRows<2>().rowwise().maxCoeff();
  for (int i = 0; i < kCells * kCells; ++i) {
    const Eigen::Vector2d at((i % kCells + 0.5) / kCells * size.x(),
                             (i / kCells + 0.5) / kCells * size.y());
    const double across = (at - front.apex.head<2>()).squaredNorm();
    below -= front.apex.z() + 60.0 - std::sqrt(3600.0 - across);
  }
  below *= size.prod() / (kCells * kCells);
  EXPECT_NEAR(enclosed_volume(solid), volume_below(mesh) + below, 1e-4 * volume_below(mesh));
}

TEST(ClosedSolid, SurfaceBelowItsFrontIsRefused) {
  EXPECT_THAT(
      [] {
        (void)closed_solid(smooth_lens(), "lens", SphericalFront{60.0, {10.0, 10.0, 9.0}});
      },
      ::testing::ThrowsMessage<InputError>(HasSubstr("lens: reaches down to its front")));
}

TEST(ClosedSolid, VolumeOfABlockIsExact) {
  EXPECT_NEAR(enclosed_volume(closed_solid(grid_mesh(5, 4, 2.0, 3.0), "block")), 8.0 * 6.0 * 3.0,
              1e-12);
}

TEST(ClosedSolid, FoldedSurfaceIsRefused) {
  SurfaceMesh mesh = grid_mesh(5, 5);
  mesh.vertices(0, 12) += 1.5;
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(mesh, "here.ply"); }),
              ::testing::AllOf(HasSubstr("here.ply"), HasSubstr("no height field")));
}

TEST(ClosedSolid, UpsideDownSurfaceIsRefused) {
  SurfaceMesh mesh = grid_mesh(4, 4);
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(mesh, "m"); }),
              HasSubstr("no height field"));
}

TEST(ClosedSolid, SurfaceBelowItsBackIsRefused) {
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(grid_mesh(4, 4, 1.0, -0.5), "m"); }),
              HasSubstr("z = -0.5"));
}

TEST(ClosedSolid, HoleIsRefused) {
  SurfaceMesh mesh = grid_mesh(6, 6);
  mesh.triangles.col(24) = mesh.triangles.rightCols(1);
  mesh.triangles.conservativeResize(3, mesh.triangle_count() - 1);
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(mesh, "m"); }), HasSubstr("holes"));
}

TEST(ClosedSolid, TwoPiecesAreRefused) {
  SurfaceMesh mesh = grid_mesh(3, 2);
  SurfaceMesh two = mesh;
  two.vertices.resize(3, 12);
  two.vertices.leftCols(6) = mesh.vertices;
  two.vertices.rightCols(6) = mesh.vertices.colwise() + Eigen::Vector3d(10.0, 0.0, 0.0);
  two.triangles.resize(3, 8);
  two.triangles.leftCols(4) = mesh.triangles;
  two.triangles.rightCols(4) = mesh.triangles.array() + 6;
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(two, "m"); }), HasSubstr("pieces"));
}

/// The cells of a grid that `keep` names by column and row.
template <class Keep>
SurfaceMesh cells_of(SurfaceMesh mesh, int columns, const Keep& keep) {
  std::vector<int> kept;
  for (int t = 0; t < mesh.triangle_count(); ++t) {
    if (keep(t / 2 % columns, t / 2 / columns)) kept.push_back(t);
  }
  mesh.triangles = Eigen::Matrix3Xi(mesh.triangles(Eigen::all, kept));
  return mesh;
}

TEST(ClosedSolid, OutlineThatHidesFromItsMiddleIsClosed) {
  const auto in_l = [](int column, int row) { return column == 0 || row == 0; };
  const SurfaceMesh mesh = cells_of(grid_mesh(7, 7, 2.0, 3.0), 6, in_l);
  const SurfaceMesh solid = closed_solid(mesh, "m");
  expect_watertight(solid);
  EXPECT_NEAR(enclosed_volume(solid), 11.0 * 2.0 * 2.0 * 3.0, 1e-12);
}

/// A strip that turns by more than one round and comes to lie on itself.
TEST(ClosedSolid, OutlineThatCrossesItselfIsRefused) {
  constexpr int kSteps = 20;
  SurfaceMesh mesh = grid_mesh(2, kSteps + 1);
  for (int k = 0; k <= kSteps; ++k) {
    const double angle = -0.4 * k;
    mesh.vertices.col(2 * k) << 3.0 * std::cos(angle), 3.0 * std::sin(angle), 5.0;
    mesh.vertices.col(2 * k + 1) << 1.0 * std::cos(angle), 1.0 * std::sin(angle), 5.0;
  }
  EXPECT_THAT(message_of<InputError>([&] { closed_solid(mesh, "m"); }),
              HasSubstr("crosses or touches itself"));
}

}  // namespace
}  // namespace lensforge::testing
