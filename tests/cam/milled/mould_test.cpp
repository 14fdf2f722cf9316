// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/mould.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "cam/cam_meshes.h"
#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kWidth = 6.0;
constexpr double kDepth = 4.0;

/// Neither symmetric from left to right nor from front to back.
double relief(double x, double y) { return 7.0 + 0.1 * x + 0.05 * y + 0.02 * x * x * y; }

SurfaceMesh lens() { return testing::grid_mesh(13, 9, kWidth, kDepth, relief); }

/// What comes out of the mould: its surface, smaller by the shrinkage, turned over about the y
/// axis.
SurfaceMesh cast(const SurfaceMesh& mould, double shrinkage) {
  SurfaceMesh part = mould;
  const Eigen::Matrix3d over =
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()).toRotationMatrix();
  part.vertices = (1.0 - shrinkage) * over * mould.vertices;
  part.vertices.row(0).array() -= part.vertices.row(0).minCoeff();
  return part;
}

TEST(Mould, CastHasTheLensesSurface) {
  for (const double shrinkage : {0.0, 0.006, 0.05}) {
    const SurfaceMesh original = lens();
    const SurfaceMesh part = cast(mould_surface(original, {shrinkage, 5.0}), shrinkage);
    const ProfileCutter wanted(original);
    const ProfileCutter got(part);
    const double base = got.drop({}, {1.0, 1.0}).tip - wanted.drop({}, {1.0, 1.0}).tip;
    for (double y = 0.05; y < kDepth; y += 0.3) {
      for (double x = 0.05; x < kWidth; x += 0.3) {
        EXPECT_NEAR(got.drop({}, {x, y}).tip - base, wanted.drop({}, {x, y}).tip, 1e-9);
      }
    }
  }
}

TEST(Mould, IsAHeightFieldThatTheCutterAccepts) {
  const double shrinkage = 0.02;
  const SurfaceMesh mould = mould_surface(lens(), {shrinkage, 4.0});
  const Eigen::Vector2d size = Eigen::Vector2d(kWidth, kDepth) / (1.0 - shrinkage);
  const HeightField field = inspect_height_field(mould, size);
  EXPECT_NEAR(field.box.min().z(), 4.0, 1e-12);
  EXPECT_NEAR(field.box.sizes().z(), (relief(kWidth, kDepth) - relief(0.0, 0.0)) / 0.98, 1e-12);
}

TEST(Mould, IsMirroredAndNegative) {
  const SurfaceMesh original = lens();
  const SurfaceMesh mould = mould_surface(original, {});
  const ProfileCutter surface(mould);
  // The lens is highest at its far right corner; the mould is lowest at its far left one.
  EXPECT_NEAR(surface.drop({}, {0.0, kDepth}).tip, 5.0, 1e-9);
  EXPECT_NEAR(surface.drop({}, {kWidth, 0.0}).tip, 5.0 + relief(kWidth, kDepth) - relief(0.0, 0.0),
              1e-9);
}

TEST(Mould, KeepsTheGrid) {
  const SurfaceMesh mould = mould_surface(lens(), {0.1, 5.0});
  EXPECT_EQ(mould.grid, (GridShape{13, 9}));
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 13; ++column) {
      const Eigen::Vector3d at = mould.vertices.col(row * 13 + column);
      EXPECT_NEAR(at.x(), kWidth * column / 12.0 / 0.9, 1e-12);
      EXPECT_NEAR(at.y(), kDepth * row / 8.0 / 0.9, 1e-12);
    }
  }
}

TEST(Mould, RefusesWhatCannotBe) {
  EXPECT_THROW((void)mould_surface(lens(), {-0.01, 5.0}), InputError);
  EXPECT_THROW((void)mould_surface(lens(), {0.3, 5.0}), InputError);
  EXPECT_THROW((void)mould_surface(lens(), {std::nan(""), 5.0}), InputError);
  EXPECT_THROW((void)mould_surface(lens(), {0.0, 0.0}), InputError);
}

}  // namespace
}  // namespace lensforge
