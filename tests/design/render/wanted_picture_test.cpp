// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/mesh/surface_mesh.h"
#include "design/render/source_picture.h"

namespace lensforge::testing {
namespace {

/// A plate without relief, whose picture is evenly lit.
class WantedPictureOfAPlate : public ::testing::Test {
 protected:
  WantedPictureOfAPlate() {
    setup_.pixels = {40, 40};
    plate_ = make_grid_mesh(setup_.lens_size, {81, 93}, 5.0);
    target_ = Image(40, 40, 1.0F);
  }

  /// Normals of the slopes −share · (x − middle) / reach.
  [[nodiscard]] Eigen::Matrix3Xd gathering(double share, double reach) const {
    Eigen::Matrix3Xd normals(3, plate_.vertex_count());
    for (Eigen::Index v = 0; v < normals.cols(); ++v) {
      const Eigen::Vector2d off = plate_.vertices.col(v).head<2>() - 0.5 * setup_.lens_size;
      normals.col(v) << share / reach * off, 1.0;
    }
    return normals;
  }

  OpticalSetup setup_;
  SurfaceMesh plate_;
  Image target_;
  Executor executor_ = Executor::cpu(2);
};

TEST_F(WantedPictureOfAPlate, LacksNothingOfItself) {
  const WantedPicture wanted(plate_, setup_, target_, executor_);
  const auto found = wanted.compare(plate_, gathering(0.0, 1.0));
  EXPECT_NEAR(found.excess, 0.0, 1e-9);
  EXPECT_LT(found.missing.cwiseAbs().maxCoeff(), 1e-6);
}

/// Light gathered into half the width and height is four times as bright there.
TEST_F(WantedPictureOfAPlate, LacksMinusThreeWhereLightIsGatheredFourfold) {
  const WantedPicture wanted(plate_, setup_, target_, executor_);
  EXPECT_NEAR(wanted.reach(), 0.49 * 295.0, 1e-9);
  const auto found = wanted.compare(plate_, gathering(0.5, wanted.reach()));
  EXPECT_GT(found.excess, 0.5);
  for (Eigen::Index v = 0; v < plate_.vertex_count(); ++v) {
    const Eigen::Vector2d off = plate_.vertices.col(v).head<2>() - 0.5 * setup_.lens_size;
    if (off.cwiseAbs().maxCoeff() > 40.0) continue;
    EXPECT_NEAR(found.missing[v], -3.0, 0.3);
  }
}

/// Landing points of light from a surface of slope s₀ + B (x − x₀), by central differences.
TEST(WantedPicture, StretchIsHowLandingPlacesChange) {
  OpticalSetup setup;
  setup.pixels = {40, 40};
  const SurfaceMesh plate = make_grid_mesh(setup.lens_size, {11, 13}, 8.0);
  const Image target(40, 40, 1.0F);
  const Executor executor = Executor::serial();
  const Eigen::Vector3d p(62.0, 41.0, 8.5);
  const Eigen::Vector2d slope(0.08, -0.05);
  Eigen::Matrix2d bend;
  bend << 3e-3, -4e-4, 7e-4, -2e-3;
  const auto check = [&] {
    const LightPath light(setup);
    const auto land = [&](const Eigen::Vector2d& d) -> Eigen::Vector2d {
      const Eigen::Vector2d s = slope + bend * d;
      const double z = p.z() + d.dot(slope + 0.5 * bend * d);
      const Eigen::Vector3d at(p.x() + d.x(), p.y() + d.y(), z);
      const Eigen::Vector3d n = Eigen::Vector3d(-s.x(), -s.y(), 1.0).normalized();
      return light.land(at, light.beam(at, n).m).cwiseQuotient(light.plane().pixels_per_mm());
    };
    const Eigen::Matrix2d found =
        WantedPicture(plate, setup, target, executor).stretch(p, slope, bend);
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d d = 1e-3 * Eigen::Vector2d::Unit(k);
      EXPECT_LT(((land(d) - land(-d)) / 2e-3 - found.col(k)).norm(), 1e-6 * found.norm());
    }
  };
  check();
  setup.front = SphericalFront{150.0, {50.0, 50.0, -9.0}};
  check();
  setup.lamp = PointSource{{40.0, 60.0, -300.0}, Emission::kIsotropic};
  check();
  setup.front.reset();
  check();
}

}  // namespace
}  // namespace lensforge::testing
