// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mesh/surface_mesh.h"
#include "core/optics/screen.h"
#include "design/flux/flux_triangle.h"
#include "design/schedule/face_transport.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

constexpr int kPixels = 32;

OpticalSetup setup_of(double side) {
  OpticalSetup setup;
  setup.ior = 1.49;
  setup.focal_length = 3.0 * side;
  setup.lens_size = {side, side};
  setup.image_size = setup.lens_size;
  setup.pixels = {kPixels, kPixels};
  return setup;
}

/// Light in the left 6 and the right 8 columns alone: the only crease of the even transport is
/// the line u = 32 · 6/14, give or take half a site.
Image two_bands() {
  Image picture(kPixels, kPixels);
  for (int r = 0; r < kPixels; ++r) {
    for (int c = 0; c < kPixels; ++c) picture.at(c, r) = c < 6 || c >= 24 ? 1.0F : 0.0F;
  }
  return picture;
}

/// A flat mesh, the transport of its light to a picture, and the map.
struct Scene {
  explicit Scene(Image wanted)
      : picture(std::move(wanted)),
        mesh(make_grid_mesh(setup.lens_size, {25, 30}, 5.0)),
        light(face_light(mesh, setup, SurfaceModel::kFacet, Executor::cpu(1))),
        result(transport_faces(light, picture, {}, Executor::cpu(1), RunControl())),
        map(light.landing, result, picture) {}

  OpticalSetup setup = setup_of(50.0);
  Image picture;
  SurfaceMesh mesh;
  FaceLight light;
  TransportResult result;
  BrenierMap map;
};

/// Faces whose corners, pulled in by a tenth, do not all lie on one side of the black.
int faces_across(const Scene& scene, const SurfaceMesh& mesh) {
  const ImagePlane plane(scene.setup);
  int count = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    const Eigen::Vector3d middle =
        (mesh.corner(f, 0) + mesh.corner(f, 1) + mesh.corner(f, 2)) / 3.0;
    int left = 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = 0.9 * mesh.corner(f, k) + 0.1 * middle;
      if (scene.map(plane.to_pixels(at.head<2>())).x() < 0.5 * kPixels) ++left;
    }
    if (left != 0 && left != 3) ++count;
  }
  return count;
}

TEST(CreaseAlignment, PutsEdgesAlongACrease) {
  const Scene scene(two_bands());
  SurfaceMesh mesh = scene.mesh;
  const int before = faces_across(scene, mesh);
  ASSERT_GT(before, 20);
  EXPECT_GT(align_to_creases(scene.map, scene.setup, mesh), 20);
  // What is left are the border's own triangles, and those that a move would have flattened.
  EXPECT_LT(faces_across(scene, mesh), before / 5);
}

TEST(CreaseAlignment, KeepsHeightsBordersAndATenthOfEveryTriangle) {
  const Scene scene(testing::logo_picture(kPixels));
  SurfaceMesh mesh = scene.mesh;
  ASSERT_GT(align_to_creases(scene.map, scene.setup, mesh), 0);
  EXPECT_EQ(mesh.vertices.row(2), scene.mesh.vertices.row(2));
  const auto area = [](const SurfaceMesh& m, Eigen::Index f) {
    const auto corner = [&](int k) -> Eigen::Vector2d { return m.corner(f, k).head<2>(); };
    return doubled_area(corner(0), corner(1), corner(2));
  };
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    EXPECT_GE(area(mesh, f), 0.099 * area(scene.mesh, f)) << f;
  }
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector2d at = scene.mesh.vertices.col(v).head<2>();
    if (at.minCoeff() > 0.0 && at.maxCoeff() < 50.0) continue;
    EXPECT_EQ(mesh.vertices.col(v), scene.mesh.vertices.col(v)) << v;
  }
}

TEST(CreaseAlignment, LeavesAMeshWithoutCreasesAlone) {
  const Scene scene(Image(kPixels, kPixels, 0.5F));
  SurfaceMesh mesh = scene.mesh;
  EXPECT_EQ(align_to_creases(scene.map, scene.setup, mesh), 0);
  EXPECT_EQ(mesh.vertices, scene.mesh.vertices);
}

}  // namespace
}  // namespace lensforge
