// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/source_blur.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

/// Rings of equal area a pixel of radius, and places a pixel of their length: finer ones change no
/// share by more than 0.001.
constexpr double kRings = 6.0;
constexpr double kPlaces = 8.0;

/// Steps of the search for the radius: to 1e-9 of it.
constexpr int kBisections = 30;

/// Splits every place of a disc between the four pixels around it.
BlurKernel split_disc(const Eigen::Vector2d& radii, std::int64_t reach) {
  BlurKernel kernel{reach, {}};
  const std::int64_t side = 2 * reach + 1;
  kernel.share.assign(static_cast<std::size_t>(side * side), 0.0);
  const double radius = radii.maxCoeff();
  const auto rings = static_cast<int>(std::ceil(kRings * std::max(1.0, radius)));
  const auto places = 4 * static_cast<int>(std::ceil(kPlaces * std::max(1.0, radius)));
  const double weight = 1.0 / (rings * places);
  for (int ring = 0; ring < rings; ++ring) {
    const Eigen::Vector2d out = radii * std::sqrt((ring + 0.5) / rings);
    for (int k = 0; k < places; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / places;
      const double x = out.x() * std::cos(angle) + static_cast<double>(reach);
      const double y = out.y() * std::sin(angle) + static_cast<double>(reach);
      const double u = x - std::floor(x);
      const double v = y - std::floor(y);
      const auto at = static_cast<std::size_t>(static_cast<std::int64_t>(y) * side +
                                               static_cast<std::int64_t>(x));
      kernel.share[at] += weight * (1.0 - u) * (1.0 - v);
      kernel.share[at + 1] += weight * u * (1.0 - v);
      kernel.share[at + static_cast<std::size_t>(side)] += weight * (1.0 - u) * v;
      kernel.share[at + static_cast<std::size_t>(side) + 1] += weight * u * v;
    }
  }
  return kernel;
}

double variance(const BlurKernel& kernel, int axis) {
  const std::int64_t side = 2 * kernel.reach + 1;
  double sum = 0.0;
  for (std::int64_t n = 0; n < side * side; ++n) {
    const auto place = static_cast<double>((axis == 0 ? n % side : n / side) - kernel.reach);
    sum += kernel.share[static_cast<std::size_t>(n)] * place * place;
  }
  return sum;
}

}  // namespace

/// The variance along an axis depends on the half axis along it alone.
BlurKernel disc_blur(const Eigen::Vector2d& radii) {
  if (radii.isZero()) return {};
  const auto reach = static_cast<std::int64_t>(std::ceil(radii.maxCoeff())) + 1;
  Eigen::Vector2d low(0.0, 0.0);
  Eigen::Vector2d high = radii;
  for (int step = 0; step < kBisections; ++step) {
    const Eigen::Vector2d middle = 0.5 * (low + high);
    const BlurKernel kernel = split_disc(middle, reach);
    for (int axis = 0; axis < 2; ++axis) {
      const bool narrow = variance(kernel, axis) < 0.25 * radii[axis] * radii[axis];
      (narrow ? low : high)[axis] = middle[axis];
    }
  }
  return split_disc(0.5 * (low + high), reach);
}

FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor) {
  FluxRaster result{raster.columns, raster.rows, std::vector<double>(raster.flux.size(), 0.0)};
  const std::int64_t side = 2 * kernel.reach + 1;
  const auto blur_row = [&](std::int64_t row) {
    double* const out = &result.flux[static_cast<std::size_t>(row * raster.columns)];
    for (std::int64_t b = -kernel.reach; b <= kernel.reach; ++b) {
      const std::int64_t from = row - b;
      if (from < 0 || from >= raster.rows) continue;
      const double* const in = &raster.flux[static_cast<std::size_t>(from * raster.columns)];
      const double* const share =
          &kernel.share[static_cast<std::size_t>((b + kernel.reach) * side)];
      for (std::int64_t a = -kernel.reach; a <= kernel.reach; ++a) {
        const std::int64_t low = std::max<std::int64_t>(0, a);
        const std::int64_t high = std::min(raster.columns, raster.columns + a);
        for (std::int64_t i = low; i < high; ++i) out[i] += share[a + kernel.reach] * in[i - a];
      }
    }
  };
  parallel_for(executor, "blur by the source", raster.rows, blur_row, 4);
  return result;
}

}  // namespace lensforge
