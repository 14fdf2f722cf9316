// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "cam/tolerance/part_light.h"

namespace lensforge {
namespace {

/// Σ share · x^a · y^b
double moment(const BlurKernel& kernel, int a, int b) {
  const std::int64_t side = 2 * kernel.reach + 1;
  double sum = 0.0;
  for (std::int64_t j = 0; j < side; ++j) {
    for (std::int64_t i = 0; i < side; ++i) {
      sum += kernel.share[static_cast<std::size_t>(j * side + i)] *
             std::pow(static_cast<double>(i - kernel.reach), a) *
             std::pow(static_cast<double>(j - kernel.reach), b);
    }
  }
  return sum;
}

TEST(DiscBlur, IsAsWideAsTheDiscHoweverSmall) {
  for (const double radius : {0.02, 0.1, 0.3, 0.8, 1.0, 2.7, 9.0}) {
    SCOPED_TRACE(radius);
    const BlurKernel kernel = disc_blur({radius, radius});
    EXPECT_NEAR(moment(kernel, 0, 0), 1.0, 1e-12);
    EXPECT_NEAR(moment(kernel, 1, 0), 0.0, 1e-9);
    EXPECT_NEAR(moment(kernel, 2, 0), radius * radius / 4.0, 1e-6 * radius * radius);
    EXPECT_NEAR(moment(kernel, 0, 2), radius * radius / 4.0, 1e-6 * radius * radius);
    EXPECT_GE(*std::min_element(kernel.share.begin(), kernel.share.end()), 0.0);
  }
}

TEST(DiscBlur, OfALargeDiscIsEven) {
  const double radius = 9.0;
  const BlurKernel kernel = disc_blur({radius, radius});
  const double middle = 1.0 / (3.14159265 * radius * radius);
  const std::int64_t side = 2 * kernel.reach + 1;
  for (const std::int64_t x : {1, 3, 7}) {
    const auto n = static_cast<std::size_t>(kernel.reach * side + kernel.reach + x);
    EXPECT_NEAR(kernel.share[n], middle, 0.1 * middle) << x;
  }
}

TEST(DiscBlur, MovesNoLightOffAPictureThatEndsInBlack) {
  FluxRaster raster{16, 12, std::vector<double>(16 * 12, 0.0)};
  raster.flux[5 * 16 + 7] = 1.0;
  raster.flux[6 * 16 + 8] = 0.5;
  const FluxRaster after = blurred(raster, disc_blur({0.6, 0.6}), Executor::cpu(2));
  EXPECT_NEAR(std::accumulate(after.flux.begin(), after.flux.end(), 0.0), 1.5, 1e-12);
}

TEST(DiscBlur, LeavesAnEvenPictureEven) {
  const FluxRaster raster{30, 30, std::vector<double>(900, 2.0)};
  const FluxRaster after = blurred(raster, disc_blur({1.3, 1.3}), Executor::serial());
  EXPECT_NEAR(after.flux[15 * 30 + 15], 2.0, 1e-12);
}

}  // namespace
}  // namespace lensforge
