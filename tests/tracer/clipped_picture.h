// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "tracer/lens_files.h"

namespace tracer {

using Triangle = std::array<Vec2, 3>;  ///< Columns and rows of the picture.

/// Adds evenly lit triangles up, pixel by pixel: each is clipped to every pixel that it touches.
class ClippedPicture {
 public:
  ClippedPicture(int columns, int rows);

  /// Light outside the picture is dropped.
  void add(const Triangle& t, double light);
  [[nodiscard]] const std::vector<double>& light() const { return light_; }

 private:
  int columns_;
  int rows_;
  std::vector<double> light_;
};

}  // namespace tracer
