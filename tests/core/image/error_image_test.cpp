// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/image/image.h"
#include "core/image/transfer.h"

namespace lensforge {
namespace {

using Color = std::array<unsigned char, 3>;

Color color_at(const ColorImage& image, int column, int row) {
  const int index = 3 * (row * image.columns + column);
  const auto pixel = static_cast<std::size_t>(index);
  return {image.rgb[pixel], image.rgb[pixel + 1], image.rgb[pixel + 2]};
}

double lightness(const Color& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

TEST(ErrorImage, FalseColoursGrowLighterAllTheWay) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_LT(lightness(false_color(i / 100.0)), lightness(false_color((i + 1) / 100.0)));
  }
  EXPECT_EQ(false_color(-1.0), false_color(0.0));
  EXPECT_EQ(false_color(7.0), false_color(1.0));
}

TEST(ErrorImage, SmallPicturesAreEnlargedByAWholeNumberBesideTheLegend) {
  const ColorImage image = error_image(Image(40, 20, 0.5F), Image(40, 20, 0.5F));
  EXPECT_EQ(image.rows, 20 * 13);
  EXPECT_GT(image.columns, 40 * 13);
  EXPECT_EQ(image.rgb.size(), static_cast<std::size_t>(3 * image.columns * image.rows));
}

TEST(ErrorImage, LargePicturesKeepTheirPixels) {
  const ColorImage image = error_image(Image(300, 256, 0.5F), Image(300, 256, 0.5F));
  EXPECT_EQ(image.rows, 256);
}

TEST(ErrorImage, LongNarrowPicturesAreNotEnlargedWithoutBound) {
  const ColorImage image = error_image(Image(4000, 1, 0.5F), Image(4000, 1, 0.5F));
  EXPECT_LT(image.columns, 4300);
  EXPECT_EQ(image.rows, 256);
}

TEST(ErrorImage, NoErrorIsBlackAndTheLargestIsOnTheScale) {
  const int side = 64;
  Image target(side, side, static_cast<float>(decode(0.5)));
  Image render = target;
  // A quarter of the pixels is wrong by 0.2: the scale ends there.
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side / 4; ++column) {
      render.at(column, row) = static_cast<float>(decode(0.7 - 1e-6));
    }
  }
  const ColorImage image = error_image(render, target);
  EXPECT_EQ(color_at(image, 4 * 40, 100), false_color(0.0));
  EXPECT_EQ(color_at(image, 4 * 5, 100), false_color(1.0));
}

TEST(ErrorImage, TheBarRunsOverTheWholeScale) {
  const ColorImage image = error_image(Image(256, 256, 0.2F), Image(256, 256, 0.5F));
  const int bar = 256 + 8 + 3;
  EXPECT_EQ(color_at(image, bar, 8 + 5), false_color(1.0));
  EXPECT_EQ(color_at(image, bar, 255 - 8 - 5), false_color(0.0));
}

}  // namespace
}  // namespace lensforge
