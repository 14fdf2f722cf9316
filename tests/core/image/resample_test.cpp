// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "core/image/image_io.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using lensforge::testing::random_image;

TEST(Resample, TheSameSizeIsTheSamePicture) {
  const Image image = random_image(13, 7);
  EXPECT_EQ(resample(image, 13, 7), image);
}

TEST(Resample, EveryResultIsTheMeanOfItsArea) {
  const Image image = random_image(10, 7);
  // Reference: on the common multiple of both grids every cell belongs to one pixel of each.
  const Image result = resample(image, 4, 3);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      double sum = 0.0;
      for (int i = 0; i < 10 * 7; ++i) {
        sum += image.at((column * 10 + i % 10) / 4, (row * 7 + i / 10) / 3);
      }
      EXPECT_NEAR(result.at(column, row), sum / 70.0, 1e-7);
    }
  }
}

TEST(Resample, TheMeanIsKept) {
  const Image image = random_image(101, 67);
  const double mean = image.total() / (101.0 * 67.0);
  for (const auto& [columns, rows] : std::vector<std::pair<int, int>>{
           {1, 1}, {50, 30}, {100, 66}, {102, 68}, {256, 311}, {7, 500}}) {
    const double resampled = resample(image, columns, rows).total() / (columns * rows);
    EXPECT_NEAR(resampled / mean, 1.0, 1e-6) << columns << " x " << rows;
  }
}

TEST(Resample, EnlargingByAWholeNumberRepeatsPixels) {
  const Image image = random_image(3, 2);
  const Image large = resample(image, 9, 4);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 9; ++column) {
      EXPECT_FLOAT_EQ(large.at(column, row), image.at(column / 3, row / 2));
    }
  }
}

}  // namespace
}  // namespace lensforge
