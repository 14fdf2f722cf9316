// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/relief_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/image/error_image.h"

namespace lensforge {
namespace {

constexpr double kPercentile = 0.995;
constexpr double kSmallestTop = 1e-3;

double percentile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

void append(ColorImage& image, const std::array<unsigned char, 3>& color) {
  image.rgb.insert(image.rgb.end(), color.begin(), color.end());
}

/// Slope of a raster at (column, row counted from the least y), from its neighbours.
Eigen::Vector2d slope_at(const LensRaster& surface, const Eigen::Vector2d& step, int column,
                         int row) {
  const auto height = [&](int c, int r) {
    const int at = std::clamp(r, 0, surface.rows - 1) * surface.columns +
                   std::clamp(c, 0, surface.columns - 1);
    return static_cast<double>(surface.values[static_cast<std::size_t>(at)]);
  };
  return {(height(column + 1, row) - height(column - 1, row)) / (2.0 * step.x()),
          (height(column, row + 1) - height(column, row - 1)) / (2.0 * step.y())};
}

}  // namespace

ColorImage relief_picture(const LensRaster& surface, const Eigen::Vector2d& size) {
  const Eigen::Vector2d step(size.x() / std::max(1, surface.columns - 1),
                             size.y() / std::max(1, surface.rows - 1));
  std::vector<Eigen::Vector2d> slopes;
  std::vector<double> steep;
  for (int row = surface.rows - 1; row >= 0; --row) {
    for (int column = 0; column < surface.columns; ++column) {
      slopes.push_back(slope_at(surface, step, column, row));
      steep.push_back(slopes.back().norm());
    }
  }
  const double usual = std::max(1e-9, percentile(steep, 0.9));
  const Eigen::Vector3d light = Eigen::Vector3d(-0.6, 0.6, 0.75).normalized();
  ColorImage image{surface.columns, surface.rows, {}};
  for (const Eigen::Vector2d& slope : slopes) {
    const Eigen::Vector2d lean = slope / usual;
    const Eigen::Vector3d normal = Eigen::Vector3d(-lean.x(), -lean.y(), 1.0).normalized();
    const double shade = 0.1 + 0.9 * std::max(0.0, normal.dot(light));
    const auto grey = static_cast<unsigned char>(std::lround(255.0 * std::min(1.0, shade)));
    append(image, {grey, grey, grey});
  }
  return image;
}

double scale_top(const std::vector<double>& values) {
  return std::max(kSmallestTop, percentile(values, kPercentile));
}

ColorImage scaled_picture(const std::vector<double>& values, int columns, int rows, double top) {
  ColorImage image{columns, rows, {}};
  for (const double value : values) append(image, false_color(value / top));
  return image;
}

ColorImage raster_picture(const LensRaster& raster, double low, double high) {
  ColorImage image{raster.columns, raster.rows, {}};
  const double range = high > low ? high - low : 1.0;
  for (int row = raster.rows - 1; row >= 0; --row) {
    for (int column = 0; column < raster.columns; ++column) {
      const int at = row * raster.columns + column;
      const float value = raster.values[static_cast<std::size_t>(at)];
      append(image, false_color((static_cast<double>(value) - low) / range));
    }
  }
  return image;
}

}  // namespace lensforge
