// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/image/image.h"
#include "core/optics/picture_blur.h"
#include "design/design.h"
#include "design/schedule/levels.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

constexpr double kWavelength = 550e-6;
constexpr double kDisplayFloor = 0.25 / 255.0;

/// A wall on which diffraction is 1.04 pixels wide: σ of its blur is 0.2 of that.
OpticalSetup sharp_wall(int pixels) {
  return testing::setup_of(Eigen::Vector2d::Constant(25.0 / 128 * pixels), {pixels, pixels}, 80.0);
}

/// The picture in `parts` parts a pixel each way, blurred by summing a Gaussian over them all.
Image blurred_by_force(const Image& picture, double sigma) {
  constexpr int kParts = 24;
  const int side = picture.columns();
  const auto one_way = [&](const std::vector<double>& line) {
    std::vector<double> result(line.size(), 0.0);
    for (int to = 0; to < side * kParts; ++to) {
      for (int from = 0; from < side * kParts; ++from) {
        const double u = (to - from) / (sigma * kParts);
        if (std::fabs(u) > 6.0) continue;
        result[static_cast<std::size_t>(to / kParts)] +=
            line[static_cast<std::size_t>(from / kParts)] * std::exp(-0.5 * u * u);
      }
    }
    const double all = kParts * kParts * sigma * std::sqrt(2.0 * std::numbers::pi);
    for (double& value : result) value /= all;
    return result;
  };
  const auto along = [&](const Image& from, bool rows) {
    Image to(side, side);
    for (int line = 0; line < side; ++line) {
      std::vector<double> values(static_cast<std::size_t>(side));
      for (int k = 0; k < side; ++k) {
        values[static_cast<std::size_t>(k)] = rows ? from.at(k, line) : from.at(line, k);
      }
      values = one_way(values);
      for (int k = 0; k < side; ++k) {
        float& value = rows ? to.at(k, line) : to.at(line, k);
        value = static_cast<float>(values[static_cast<std::size_t>(k)]);
      }
    }
    return to;
  };
  return along(along(picture, true), false);
}

TEST(PictureFloor, IsTheErrorOfABlurOfAFifthOfDiffraction) {
  const OpticalSetup setup = sharp_wall(12);
  const Image target = testing::random_picture(12, 12, 0.1, 3);
  const double sigma = 0.2 * diffraction_width(setup, 5.0, kWavelength) / pixel_width(setup);
  EXPECT_NEAR(sigma, 0.2, 0.02);
  const double error = compare(blurred_by_force(target, sigma), target).mae;
  EXPECT_GT(error, 0.01);
  EXPECT_NEAR(picture_floor(target, setup, 5.0, kWavelength), std::hypot(error, kDisplayFloor),
              0.01 * error);
}

TEST(PictureFloor, OfALampWiderThanDiffractionIsThatOfTheDisplay) {
  OpticalSetup setup = sharp_wall(12);
  const Image target = testing::random_picture(12, 12, 0.1, 3);
  const double sharp = picture_floor(target, setup, 5.0, kWavelength);
  setup.extent.width = 2e-3;  // 0.15 mm on the wall.
  const double soft = picture_floor(target, setup, 5.0, kWavelength);
  EXPECT_LT(soft, 0.8 * sharp);
  EXPECT_GT(soft, kDisplayFloor);
  setup.extent.width = 20e-3;
  EXPECT_EQ(picture_floor(target, setup, 5.0, kWavelength), kDisplayFloor);
}

TEST(Finish, AimsAtATenthMoreThanTheFloorAndLessThanAStepOfADisplay) {
  constexpr double kFloor = 0.004;
  EXPECT_NEAR(std::hypot(kFloor, Finish(kFloor).goal()), 1.1 * kFloor, 1e-12);
  EXPECT_LT(Finish(1.0).goal(), 1.0 / 255.0);
  EXPECT_EQ(Finish().goal(), 0.0);
}

TEST(Finish, IsIdleWhereTheFloorHidesWhatIterationsGain) {
  std::vector<double> errors;
  for (int i = 0; i <= 20; ++i) errors.push_back(0.001 * std::pow(0.98, i));
  EXPECT_TRUE(Finish(0.01).idle(errors));
  EXPECT_FALSE(Finish(0.0005).idle(errors));
  EXPECT_FALSE(Finish().idle(errors));
  errors.pop_back();
  EXPECT_FALSE(Finish(0.01).idle(errors));  // Too few to tell.
}

TEST(Finish, EndsADesignThatPaperQualityGoesOnWith) {
  const Image target = testing::spot_picture(32, 32);
  DesignOptions options = default_design_options(SurfaceModel::kSpline, target);
  options.width = 25.0;
  options.focal_length = 75.0;
  const DesignResult standard = design_lens(target, options, Executor::cpu(2), {});
  options.iterations = DesignOptions::kPaperIterations;
  const DesignResult paper = design_lens(target, options, Executor::cpu(2), {});
  const double goal =
      Finish(picture_floor(target, standard.lens.setup, options.thickness, kWavelength)).goal();
  const auto error = [](const DesignResult& result) {
    return result.lens.metrics.at(SurfaceModel::kSpline).mae;
  };
  EXPECT_LT(error(standard), 1.1 * goal);  // Iterations count with fewer rays than the picture.
  EXPECT_LT(2 * standard.convergence.size(), paper.convergence.size());
  EXPECT_LT(error(paper), error(standard));
}

}  // namespace
}  // namespace lensforge
