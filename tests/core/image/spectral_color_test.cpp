// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <numeric>

#include "core/image/color.h"

namespace lensforge {
namespace {

TEST(SpectralColor, MatchesTheTablesOfCie1931) {
  // CIE 1931 2° observer.
  const struct {
    double nm;
    Eigen::Vector3d xyz;
  } table[] = {{450.0, {0.3362, 0.0380, 1.7721}},
               {500.0, {0.0049, 0.3230, 0.2720}},
               {550.0, {0.4334, 0.9950, 0.0087}},
               {600.0, {1.0622, 0.6310, 0.0008}},
               {650.0, {0.2835, 0.1070, 0.0000}}};
  for (const auto& row : table) {
    EXPECT_LT((color_matching(row.nm) - row.xyz).cwiseAbs().maxCoeff(), 0.03) << row.nm;
  }
}

TEST(SpectralColor, BrightnessSumsToOneAndIsMostlyGreen) {
  const std::vector<double> shares = brightness_shares({450.0, 550.0, 650.0});
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-15);
  EXPECT_GT(shares[1], 0.8);
}

TEST(SpectralColor, AllWavelengthsTogetherAreWhiteAndEachAloneIsItsColour) {
  const std::vector<double> wavelengths{450.0, 550.0, 620.0};
  const Image on(1, 1, 1.0F);
  const Image off(1, 1, 0.0F);
  EXPECT_EQ(color_picture({on, on, on}, wavelengths).rgb,
            (std::vector<unsigned char>{255, 255, 255}));
  const std::vector<unsigned char> blue = color_picture({on, off, off}, wavelengths).rgb;
  EXPECT_GT(blue[2], 200);
  EXPECT_LT(blue[1], 60);
  const std::vector<unsigned char> red = color_picture({off, off, on}, wavelengths).rgb;
  EXPECT_GT(red[0], 200);
  EXPECT_LT(red[2], 60);
}

}  // namespace
}  // namespace lensforge
