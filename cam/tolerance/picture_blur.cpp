// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/picture_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

constexpr std::int64_t kNodes = 6;   ///< Pixels that a distance is laid on.
constexpr std::int64_t kBefore = 2;  ///< Of them before the one that it ends in.

/// A distance as whole pixels and the shares of six of them.
struct Landing {
  std::int64_t first = 0;
  std::array<double, kNodes> share{};
};

/// Lagrange's polynomials over six pixels at `distance`.
Landing land(double distance) {
  Landing landing;
  const double whole = std::floor(distance);
  landing.first = static_cast<std::int64_t>(whole) - kBefore;
  const double t = distance - whole + kBefore;
  for (std::int64_t a = 0; a < kNodes; ++a) {
    double product = 1.0;
    for (std::int64_t b = 0; b < kNodes; ++b) {
      if (b != a) product *= (t - static_cast<double>(b)) / static_cast<double>(a - b);
    }
    landing.share[static_cast<std::size_t>(a)] = product;
  }
  return landing;
}

std::int64_t reach_of(double distance) {
  return static_cast<std::int64_t>(std::ceil(distance)) + kNodes - kBefore - 1;
}

}  // namespace

BlurKernel line_blur(std::span<const WeightedValue> distances) {
  double farthest = 0.0;
  for (const WeightedValue& d : distances) farthest = std::max(farthest, std::abs(d.value));
  BlurKernel kernel;
  kernel.reach = reach_of(farthest);
  kernel.share.assign(static_cast<std::size_t>(2 * kernel.reach + 1), 0.0);
  for (const WeightedValue& d : distances) {
    const Landing landing = land(d.value);
    for (std::int64_t a = 0; a < kNodes; ++a) {
      kernel.share[static_cast<std::size_t>(landing.first + a + kernel.reach)] +=
          d.share * landing.share[static_cast<std::size_t>(a)];
    }
  }
  return kernel;
}

/// Rings of equal area through the middles of their areas, as many as pixels; moments of up to the
/// fourth order are the disc's with three Gauss rings and eight places on each.
BlurKernel disc_blur(double radius) {
  // Gauss and Legendre over the squared radius: three to a part.
  constexpr std::array<double, 3> kNode{0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417};
  constexpr std::array<double, 3> kWeight{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  const auto parts = static_cast<int>(std::max(1.0, std::ceil(radius / 3.0)));
  const auto places = static_cast<int>(std::max(8.0, std::ceil(8.0 * radius)));
  BlurKernel kernel;
  kernel.reach = reach_of(radius);
  const std::int64_t side = 2 * kernel.reach + 1;
  kernel.share.assign(static_cast<std::size_t>(side * side), 0.0);
  for (int ring = 0; ring < 3 * parts; ++ring) {
    const auto node = static_cast<std::size_t>(ring % 3);
    const double ring_radius = radius * std::sqrt((ring / 3 + kNode[node]) / parts);
    for (int k = 0; k < places; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / places;
      const Landing x = land(ring_radius * std::cos(angle));
      const Landing y = land(ring_radius * std::sin(angle));
      const double weight = kWeight[node] / (parts * places);
      for (std::int64_t b = 0; b < kNodes; ++b) {
        for (std::int64_t a = 0; a < kNodes; ++a) {
          const std::int64_t at = (y.first + b + kernel.reach) * side + x.first + a + kernel.reach;
          kernel.share[static_cast<std::size_t>(at)] +=
              weight * y.share[static_cast<std::size_t>(b)] * x.share[static_cast<std::size_t>(a)];
        }
      }
    }
  }
  return kernel;
}

FluxRaster blurred_along(const FluxRaster& raster, int axis, const BlurKernel& kernel,
                         const Executor& executor) {
  FluxRaster result{raster.columns, raster.rows, std::vector<double>(raster.flux.size(), 0.0)};
  const std::int64_t step = axis == 0 ? 1 : raster.columns;
  const std::int64_t length = axis == 0 ? raster.columns : raster.rows;
  const auto blur_row = [&](std::int64_t row) {
    for (std::int64_t column = 0; column < raster.columns; ++column) {
      const std::int64_t at = axis == 0 ? column : row;
      const std::int64_t low = std::max(-kernel.reach, at - length + 1);
      const std::int64_t high = std::min(kernel.reach, at);
      const std::int64_t n = row * raster.columns + column;
      double sum = 0.0;
      for (std::int64_t k = low; k <= high; ++k) {
        sum += kernel.share[static_cast<std::size_t>(k + kernel.reach)] *
               raster.flux[static_cast<std::size_t>(n - k * step)];
      }
      result.flux[static_cast<std::size_t>(n)] = sum;
    }
  };
  parallel_for(executor, "blur", raster.rows, blur_row, 8);
  return result;
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
  parallel_for(executor, "blur", raster.rows, blur_row, 4);
  return result;
}

}  // namespace lensforge
