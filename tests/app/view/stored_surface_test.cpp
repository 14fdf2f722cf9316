// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/stored_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"

namespace lensforge::stored_surface_test {
namespace {

const Eigen::Vector2d kSize(30.0, 20.0);

OpticalSetup setup() {
  OpticalSetup made;
  made.lens_size = kSize;
  made.image_size = kSize;
  made.focal_length = 100.0;
  made.pixels = {60, 40};
  return made;
}

SurfaceMesh bumps() {
  SurfaceMesh mesh = make_grid_mesh(kSize, {31, 24}, 4.0);
  for (auto p : mesh.vertices.colwise()) {
    p.z() += 0.3 * std::sin(0.4 * p.x()) * std::cos(0.3 * p.y());
  }
  return mesh;
}

TEST(StoredNumbers, AreReadBackToHalfAStep) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-3.0, 5.0);
  std::vector<double> values(12 * 9);
  for (double& value : values) value = any(random);
  const std::vector<double> given = values;
  const StoredChannel channel = store_numbers("z", values, 12, 1e-5);
  EXPECT_EQ(channel.columns, 12);
  EXPECT_EQ(channel.rows, 9);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], given[i], 0.5001e-5);
}

TEST(StoredNumbers, OfATooWideRangeHaveLargerSteps) {
  std::vector<double> values{0.0, 1e6, 3.0, 2.0};
  EXPECT_NEAR(store_numbers("z", values, 2, 1e-6).step, 1e6 / 16777215.0, 1e-9);
}

TEST(StoredNumbers, NeedLittleRoomWhereTheyChangeSmoothly) {
  std::vector<double> values;
  values.reserve(300 * 300);
  for (int row = 0; row < 300; ++row) {
    for (int column = 0; column < 300; ++column) values.push_back(1e-4 * column * row);
  }
  EXPECT_LT(store_numbers("z", values, 300, 1e-6).text.size(), 90000U / 2);
}

TEST(StoredSurface, OfAMeshIsReadBackToHalfAStep) {
  const SurfaceMesh mesh = bumps();
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  const StoredSurface stored = store_surface(mesh, normals, setup());
  const char* const names[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const double off =
        (stored.read_back.mesh.vertices - mesh.vertices).row(axis).cwiseAbs().maxCoeff();
    EXPECT_LE(off, 0.5001 * stored.channel(names[axis])->step + 1e-9) << names[axis];
  }
  const Eigen::Matrix3Xd& kept = stored.read_back.normals;
  for (Eigen::Index v = 0; v < kept.cols(); ++v) {
    EXPECT_NEAR(kept(0, v) / kept(2, v), normals(0, v) / normals(2, v),
                0.51 * stored.channel("slope_x")->step);
    EXPECT_NEAR(kept(1, v) / kept(2, v), normals(1, v) / normals(2, v),
                0.51 * stored.channel("slope_y")->step);
  }
}

TEST(StoredSurface, FacetsHaveNoSlopes) {
  const StoredSurface stored = store_surface(bumps(), {}, setup());
  EXPECT_EQ(stored.channel("slope_x"), nullptr);
  EXPECT_EQ(stored.read_back.normals.cols(), 0);
}

TEST(StoredSurface, TrianglesFollowFromAGridAndAreStoredWithoutOne) {
  SurfaceMesh mesh = bumps();
  EXPECT_TRUE(store_surface(mesh, {}, setup()).zigzag);
  EXPECT_EQ(store_surface(mesh, {}, setup()).channel("corners"), nullptr);
  mesh.triangles = grid_triangles(mesh.grid);
  EXPECT_FALSE(store_surface(mesh, {}, setup()).zigzag);
  EXPECT_EQ(store_surface(mesh, {}, setup()).channel("corners"), nullptr);
  mesh.grid = {};
  EXPECT_NE(store_surface(mesh, {}, setup()).channel("corners"), nullptr);
}

TEST(StoredSurface, OfASplineWithEvenKnotsHasNoPlaces) {
  ControlNet net{{13, 11}, {}};
  net.points.resize(3, 13 * 11);
  for (int j = 0; j < 11; ++j) {
    for (int i = 0; i < 13; ++i) {
      net.points.col(j * 13 + i) << kSize.x() * greville_point(i, 10) / 10,
          kSize.y() * greville_point(j, 8) / 8, 4.0 + 0.1 * std::sin(i) * std::cos(0.7 * j);
    }
  }
  const StoredSurface stored = store_spline(net, 2, setup());
  EXPECT_EQ(stored.channel("x")->text, "");
  EXPECT_EQ(stored.channel("y")->text, "");
  EXPECT_EQ(stored.grid.columns, 21);
  EXPECT_EQ(stored.grid.rows, 17);
  const SampledSurface nodes = spline_nodes(net, 2);
  EXPECT_LE((stored.read_back.mesh.vertices - nodes.mesh.vertices).cwiseAbs().maxCoeff(),
            0.5001 * stored.channel("z")->step);
}

}  // namespace
}  // namespace lensforge::stored_surface_test
