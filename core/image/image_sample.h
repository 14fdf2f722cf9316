// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/image/image.h"

namespace lensforge {

/// Bilinear interpolation between pixel centres; beyond the outermost centres the border pixel's
/// value.
/// @param at  pixels, x to the right and y down from the upper left corner.
inline double bilinear(const Image& image, const Eigen::Vector2d& at) {
  const double x = std::clamp(at.x() - 0.5, 0.0, image.columns() - 1.0);
  const double y = std::clamp(at.y() - 0.5, 0.0, image.rows() - 1.0);
  const int c = static_cast<int>(x);
  const int r = static_cast<int>(y);
  const int right = std::min(c + 1, image.columns() - 1);
  const int below = std::min(r + 1, image.rows() - 1);
  const double fx = x - c;
  const double fy = y - r;
  const double upper = (1.0 - fx) * image.at(c, r) + fx * image.at(right, r);
  const double lower = (1.0 - fx) * image.at(c, below) + fx * image.at(right, below);
  return (1.0 - fy) * upper + fy * lower;
}

}  // namespace lensforge
