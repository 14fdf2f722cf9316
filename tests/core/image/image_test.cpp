// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

TEST(Image, ValuesAreStoredRowByRowFromTheTop) {
  Image image(3, 2, 0.25F);
  image.at(2, 1) = 7.0F;
  EXPECT_EQ(image.values().size(), 6U);
  EXPECT_EQ(image.values()[5], 7.0F);
  EXPECT_EQ(image.values()[0], 0.25F);
}

TEST(Image, ADefaultImageIsEmpty) {
  EXPECT_TRUE(Image().empty());
  EXPECT_EQ(Image().total(), 0.0);
}

TEST(Image, TotalIsSummedInDoublePrecision) {
  // In single precision the sum would stick at 2^24.
  EXPECT_EQ(Image(5000, 4000, 1.0F).total(), 20'000'000.0);
}

TEST(Image, EncodedValuesAreClippedToTheDisplay) {
  Image image(4, 1);
  image.at(0, 0) = -1.0F;
  image.at(1, 0) = 0.5F;
  image.at(2, 0) = 1.0F;
  image.at(3, 0) = 9.0F;
  EXPECT_EQ(encoded_values(image),
            (std::vector<double>{0.0, encode(0.5), encode(1.0), encode(1.0)}));
}

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

/// Display-encoded patterns in closed form, the same as in the Python source below.
double pattern_a(int c, int r) { return 0.5 + 0.4 * std::sin(0.37 * c + 0.11 * r * r / 8.0); }
double pattern_b(int c, int r) {
  return 0.5 + 0.4 * std::sin(0.37 * c + 0.11 * r * r / 8.0 + 0.2 * std::cos(0.5 * r));
}

template <class Pattern>
Image decoded(int columns, int rows, const Pattern& pattern) {
  Image image(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) image.at(c, r) = static_cast<float>(decode(pattern(c, r)));
  }
  return image;
}

/// Two-pass textbook formula, window by window, for one window size.
double slow_similarity(const Image& a, const Image& b, int window) {
  const auto x = encoded_values(a);
  const auto y = encoded_values(b);
  const double n = window * window;
  double total = 0.0;
  int windows = 0;
  for (int r = 0; r + window <= a.rows(); ++r) {
    for (int c = 0; c + window <= a.columns(); ++c, ++windows) {
      double ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
      const auto each = [&](const auto& visit) {
        for (int i = 0; i < window * window; ++i) {
          const int index = (r + i / window) * a.columns() + c + i % window;
          const auto k = static_cast<std::size_t>(index);
          visit(x[k], y[k]);
        }
      };
      each([&](double p, double q) { ma += p / n, mb += q / n; });
      each([&](double p, double q) {
        va += (p - ma) * (p - ma) / (n - 1), vb += (q - mb) * (q - mb) / (n - 1);
        cov += (p - ma) * (q - mb) / (n - 1);
      });
      total +=
          (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
    }
  }
  return total / windows;
}

// Source of the figures (scikit-image 0.19.3, numpy 1.24.2):
//   import numpy as np
//   from skimage.metrics import structural_similarity, peak_signal_noise_ratio
//   for rows, cols in ((40, 64), (7, 7), (31, 9)):
//     r, c = np.mgrid[0:rows, 0:cols].astype(float)
//     a = 0.5 + 0.4 * np.sin(0.37 * c + 0.11 * r * r / 8)
//     b = 0.5 + 0.4 * np.sin(0.37 * c + 0.11 * r * r / 8 + 0.2 * np.cos(0.5 * r))
//     print(structural_similarity(a, b, data_range=1),
//           peak_signal_noise_ratio(a, b, data_range=1), np.abs(a - b).mean())
struct Figures {
  int columns, rows;
  double ssim, psnr, mae;
};
constexpr Figures kFigures[] = {{64, 40, 0.987358921650494, 27.8023302818346, 0.033189396445638},
                                {7, 7, 0.943840291006487, 28.3790158078839, 0.030346326486246},
                                {9, 31, 0.983730210910659, 27.9779017694242, 0.032229784281148}};

TEST(Metrics, SsimPsnrAndMaeAgreeWithScikitImage) {
  for (const Figures& figures : kFigures) {
    const Image a = decoded(figures.columns, figures.rows, pattern_a);
    const Image b = decoded(figures.columns, figures.rows, pattern_b);
    const ImageMetrics metrics = compare(a, b);
    // Pictures hold floats: 6e-8 relative in linear light.
    EXPECT_NEAR(metrics.ssim, figures.ssim, 2e-7);
    EXPECT_NEAR(metrics.psnr, figures.psnr, 2e-5);
    EXPECT_NEAR(metrics.mae, figures.mae, 2e-7);
  }
}

TEST(Metrics, SsimAgreesWithTheTwoPassFormula) {
  const Image a = decoded(33, 21, pattern_a);
  const Image b = decoded(33, 21, pattern_b);
  EXPECT_NEAR(compare(a, b).ssim, slow_similarity(a, b, 7), 1e-12);
}

TEST(Metrics, SmallPicturesUseTheLargestOddWindowThatFits) {
  const Image a = decoded(20, 6, pattern_a);
  const Image b = decoded(20, 6, pattern_b);
  EXPECT_NEAR(compare(a, b).ssim, slow_similarity(a, b, 5), 1e-12);
  EXPECT_DOUBLE_EQ(compare(Image(1, 1, 0.3F), Image(1, 1, 0.3F)).ssim, 1.0);
  EXPECT_LT(compare(Image(2, 1, 0.3F), Image(2, 1, 0.9F)).ssim, 0.95);
}

TEST(Metrics, EqualPicturesArePerfect) {
  const Image a = decoded(16, 16, pattern_a);
  const ImageMetrics metrics = compare(a, a);
  EXPECT_EQ(metrics.mae, 0.0);
  EXPECT_EQ(metrics.psnr, std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(metrics.ssim, 1.0);
  EXPECT_EQ(metrics.mae_linear, 0.0);
}

TEST(Metrics, LinearErrorIsRelativeToTheLargestTargetFlux) {
  Image target(4, 1, 1.0F);
  target.at(0, 0) = 2.0F;
  EXPECT_DOUBLE_EQ(compare(Image(4, 1, 1.0F), target).mae_linear, 1.0 / (2.0 * 4.0));
}

TEST(Metrics, DisplayErrorClipsAtWhite) {
  EXPECT_EQ(compare(Image(8, 8, 3.0F), Image(8, 8, 1.0F)).mae, 0.0);
}

TEST(Metrics, ABlackTargetGivesFiniteFigures) {
  const ImageMetrics metrics = compare(Image(8, 8, 0.5F), Image(8, 8, 0.0F));
  EXPECT_DOUBLE_EQ(metrics.mae_linear, 0.5);
  EXPECT_NEAR(metrics.mae, encode(0.5), 1e-12);
  EXPECT_TRUE(std::isfinite(metrics.ssim));
}

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
