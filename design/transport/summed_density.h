// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "core/image.h"

namespace lensforge {

/// Mass and moments of a part of a picture: ∫ρ, ∫ρx, ∫ρy and ∫ρ(x² + y²), x and y in pixels.
struct Moments {
  double mass = 0.0;
  double x = 0.0;
  double y = 0.0;
  double second = 0.0;

  Moments& operator+=(const Moments& other) {
    mass += other.mass;
    x += other.x;
    y += other.y;
    second += other.second;
    return *this;
  }
  Moments& operator-=(const Moments& other) {
    mass -= other.mass;
    x -= other.x;
    y -= other.y;
    second -= other.second;
    return *this;
  }
};

/// A density ρ, constant on every pixel [c, c+1] × [r, r+1] and zero outside of the picture, with
/// its integrals along rows from the left border: what Green's theorem needs to integrate over any
/// polygon by a walk along its edges, ∫ρ dA = ∮ F dy with F(x, y) = ∫₀ˣ ρ(x′, y) dx′.
class SummedDensity {
 public:
  /// ρ and, at the pixel's left side, ∫ρ dx, ∫ρx dx and ∫ρx² dx from the left border.
  struct Pixel {
    double value = 0.0;
    double mass = 0.0;
    double first = 0.0;
    double second = 0.0;
  };

  /// Scales `picture` so that its integral is `total`.
  /// @pre no value is negative or not finite, their sum is positive, and so is `total`.
  SummedDensity(const Image& picture, double total);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  /// Integral over the whole picture.
  [[nodiscard]] double total() const { return border_.back().mass; }

  [[nodiscard]] const Pixel& pixel(int column, int row) const {
    return pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(column)];
  }

  /// ∮ along the right border from y = 0 to `y`: all that lies between those heights.
  /// @pre 0 ≤ y ≤ rows.
  [[nodiscard]] Moments right_border(double y) const;

 private:
  int columns_;
  int rows_;
  std::vector<Pixel> pixels_;
  std::vector<Pixel> row_end_;   ///< Per row: the integrals at x = columns.
  std::vector<Moments> border_;  ///< right_border() at every whole y.
};

}  // namespace lensforge
