// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"

// Notation (Wang et al. 2004, Eq. 13): a, b pictures; mean, var, cov over one window of N pixels;
// C1 = (K1 L)², C2 = (K2 L)² with L = 1.
namespace lensforge {
namespace {

constexpr double kC1 = 0.01 * 0.01;
constexpr double kC2 = 0.03 * 0.03;
constexpr int kWindow = 7;

/// Sums of a, b, a², b², ab.
using Sums = std::array<double, 5>;

void check_equal_sizes(const Image& a, const Image& b) {
  LF_CHECK(a.columns() == b.columns() && a.rows() == b.rows() && !a.empty(),
           std::to_string(a.columns()) + "x" + std::to_string(a.rows()) + " against " +
               std::to_string(b.columns()) + "x" + std::to_string(b.rows()));
}

Sums& operator+=(Sums& sum, const Sums& item) {
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += item[k];
  return sum;
}

double window_similarity(const Sums& sums, double count) {
  const double mean_a = sums[0] / count;
  const double mean_b = sums[1] / count;
  // Sample covariance divides by N − 1; a window of one pixel has none.
  const double sample = count > 1.0 ? count / (count - 1.0) : 0.0;
  const double var_a = sample * (sums[2] / count - mean_a * mean_a);
  const double var_b = sample * (sums[3] / count - mean_b * mean_b);
  const double cov = sample * (sums[4] / count - mean_a * mean_b);
  return ((2.0 * mean_a * mean_b + kC1) * (2.0 * cov + kC2)) /
         ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
}

/// Sums over `window` rows from `row` on, one entry per column.
std::vector<Sums> column_sums(std::span<const double> a, std::span<const double> b, int columns,
                              int row, int window) {
  std::vector<Sums> sums(static_cast<std::size_t>(columns), Sums{});
  for (int r = row; r < row + window; ++r) {
    const std::size_t begin = static_cast<std::size_t>(r) * sums.size();
    for (std::size_t c = 0; c < sums.size(); ++c) {
      const double x = a[begin + c];
      const double y = b[begin + c];
      sums[c] += {x, y, x * x, y * y, x * y};
    }
  }
  return sums;
}

double mean_similarity(std::span<const double> a, std::span<const double> b, int columns,
                       int rows) {
  const int fits = std::min({kWindow, columns, rows});
  const int window = fits % 2 == 1 ? fits : fits - 1;
  const double count = static_cast<double>(window) * window;
  double total = 0.0;
  // Each window is summed anew: 14 additions per pixel cost little and rounding errors do not
  // accumulate.
  for (int row = 0; row + window <= rows; ++row) {
    const std::vector<Sums> sums = column_sums(a, b, columns, row, window);
    for (std::size_t c = 0; c + static_cast<std::size_t>(window) <= sums.size(); ++c) {
      Sums in_window{};
      for (std::size_t k = 0; k < static_cast<std::size_t>(window); ++k) in_window += sums[c + k];
      total += window_similarity(in_window, count);
    }
  }
  return total / (static_cast<double>(columns - window + 1) * (rows - window + 1));
}

double mean_linear_error(const Image& render, const Image& target) {
  double sum = 0.0;
  float largest = 0.0F;
  for (std::size_t i = 0; i < target.values().size(); ++i) {
    sum += std::abs(static_cast<double>(render.values()[i]) - target.values()[i]);
    largest = std::max(largest, target.values()[i]);
  }
  const double scale = largest > 0.0F ? static_cast<double>(largest) : 1.0;
  return sum / (scale * static_cast<double>(target.values().size()));
}

}  // namespace

ImageMetrics compare(const Image& render, const Image& target) {
  check_equal_sizes(render, target);
  const std::vector<double> shown = encoded_values(render);
  const std::vector<double> wanted = encoded_values(target);
  double absolute = 0.0;
  double squared = 0.0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const double error = shown[i] - wanted[i];
    absolute += std::abs(error);
    squared += error * error;
  }
  const auto count = static_cast<double>(shown.size());
  ImageMetrics metrics;
  metrics.mae = absolute / count;
  metrics.psnr =
      squared > 0.0 ? 10.0 * std::log10(count / squared) : std::numeric_limits<double>::infinity();
  metrics.ssim = mean_similarity(shown, wanted, target.columns(), target.rows());
  metrics.mae_linear = mean_linear_error(render, target);
  return metrics;
}

}  // namespace lensforge
