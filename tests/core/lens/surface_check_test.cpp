// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/surface_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "core/spline/sample_splines.h"
#include "core/test_meshes.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using ::testing::Optional;

const Eigen::Vector2d kSize(6.0, 4.0);

SurfaceMesh whole() { return testing::grid_mesh(7, 5); }

void remove_triangle(SurfaceMesh& mesh, std::int64_t t) {
  mesh.triangles.col(t) = mesh.triangles.col(mesh.triangle_count() - 1).eval();
  mesh.triangles.conservativeResize(3, mesh.triangle_count() - 1);
}

TEST(HeightFieldCheck, TakesAGridAndOneWhoseVerticesAreNotShared) {
  SurfaceMesh mesh = whole();
  EXPECT_EQ(height_field_fault(mesh, kSize), std::nullopt);
  SurfaceMesh apart = mesh;
  apart.vertices.resize(3, 3 * mesh.triangle_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      apart.vertices.col(3 * t + k) = mesh.corner(t, k);
      apart.triangles(k, t) = static_cast<int>(3 * t + k);
    }
  }
  EXPECT_EQ(height_field_fault(apart, kSize), std::nullopt);
}

/// Random heights and places within the lens keep it a height field; any triangle that is missing
/// or is given twice does not.
TEST(HeightFieldCheck, FindsEveryTriangleThatIsMissingOrStandsTwice) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  SurfaceMesh mesh = whole();
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
    const bool inside = v % 7 != 0 && v % 7 != 6 && v / 7 != 0 && v / 7 != 4;
    if (inside) mesh.vertices.col(v) += Eigen::Vector3d(shift(random), shift(random), 0.0);
    mesh.vertices(2, v) += shift(random);
  }
  ASSERT_EQ(height_field_fault(mesh, kSize), std::nullopt);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    SurfaceMesh hole = mesh;
    remove_triangle(hole, t);
    EXPECT_THAT(height_field_fault(hole, kSize), Optional(HasSubstr("hole or an overlap"))) << t;
    SurfaceMesh twice = mesh;
    twice.triangles.conservativeResize(3, mesh.triangle_count() + 1);
    twice.triangles.rightCols<1>() = mesh.triangles.col(t);
    EXPECT_THAT(height_field_fault(twice, kSize), Optional(HasSubstr("no height field"))) << t;
    SurfaceMesh swapped = mesh;  // The area stays: one missing, its neighbour there twice.
    swapped.triangles.col(t) = mesh.triangles.col(t ^ 1);
    EXPECT_THAT(height_field_fault(swapped, kSize), Optional(HasSubstr("hole or an overlap"))) << t;
  }
}

TEST(HeightFieldCheck, FindsAMeshThatCoversEverythingTwice) {
  SurfaceMesh mesh = whole();
  const Eigen::Matrix3Xi once = mesh.triangles;
  mesh.triangles.resize(3, 2 * once.cols());
  mesh.triangles << once, once;
  EXPECT_THAT(height_field_fault(mesh, kSize), Optional(HasSubstr("cover 48.0000 of 24.0000")));
}

TEST(HeightFieldCheck, FindsARimThatIsNotTheRectangles) {
  SurfaceMesh notched = whole();
  notched.vertices(1, 3) = 0.3;
  EXPECT_THAT(height_field_fault(notched, kSize), Optional(HasSubstr("hole or an overlap at x")));
  EXPECT_THAT(height_field_fault(whole(), {6.0, 4.1}),
              Optional(HasSubstr("spans y 0.0000 to 4.0000 mm, not 0 to 4.1000")));
}

TEST(HeightFieldCheck, FindsTrianglesThatDoNotFaceUp) {
  SurfaceMesh turned = whole();
  turned.triangles.row(0).swap(turned.triangles.row(1));
  EXPECT_THAT(height_field_fault(turned, kSize), Optional(HasSubstr("turned over")));
  SurfaceMesh folded = whole();
  folded.vertices(0, 16) += 1.7;
  EXPECT_THAT(height_field_fault(folded, kSize), Optional(HasSubstr("turned over")));
}

OpticalSetup setup_of_sample() {
  OpticalSetup setup;
  setup.lens_size = setup.image_size = {15.0, 10.0};
  return setup;
}

TEST(SplineFault, NamesWhatCannotBeALens) {
  const ControlNet good = testing::sample_spline();
  const OpticalSetup setup = setup_of_sample();
  EXPECT_FALSE(spline_fault(good, setup));
  ControlNet net = good;
  net.points(0, 13 * 1) += 1e-3;  // The last point of the first row.
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("by lens_size it must be 15"));
  net = good;
  net.points(0, 14 * 5 + 6) = 1.0;
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("counter-clockwise"));
  net = good;
  net.points.row(2).array() -= 6.0;
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("entry face"));
}

}  // namespace
}  // namespace lensforge
