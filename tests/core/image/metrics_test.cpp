// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/image.h"
#include "core/image/transfer.h"

namespace lensforge {
namespace {

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

}  // namespace
}  // namespace lensforge
