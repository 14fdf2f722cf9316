// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/picture_errors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tracer {
namespace {

/// sRGB of linear light (IEC 61966-2-1), clipped to what a screen shows.
double shown(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
}

}  // namespace

PictureErrors picture_errors(const Traced& traced, const Picture& target, int rim) {
  double total = 0.0;
  double largest = 0.0;
  for (const double t : target.light) {
    total += t;
    largest = std::max(largest, t);
  }
  PictureErrors errors;
  double count = 0.0;
  for (int row = rim; row < target.rows - rim; ++row) {
    for (int column = rim; column < target.columns - rim; ++column) {
      const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(target.columns) +
                     static_cast<std::size_t>(column);
      const double light = traced.picture.light()[i] / traced.whole * total;
      errors.mae += std::abs(shown(light) - shown(target.light[i]));
      errors.linear += std::abs(light - target.light[i]) / largest;
      count += 1.0;
    }
  }
  errors.mae /= count;
  errors.linear /= count;
  return errors;
}

}  // namespace tracer
