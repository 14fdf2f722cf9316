// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/wanted_picture.h"

#include <gtest/gtest.h>

#include "core/surface/grid_mesh.h"

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

}  // namespace
}  // namespace lensforge::testing
