// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/compute/host_device.h"
#include "core/image/image.h"

namespace lensforge {

/// Mass and moments of a part of a picture: ∫ρ, ∫ρx, ∫ρy and ∫ρ(x² + y²), x and y in pixels.
struct Moments {
  double mass = 0.0;
  double x = 0.0;
  double y = 0.0;
  double second = 0.0;

  LF_HD Moments& operator+=(const Moments& other) {
    mass += other.mass;
    x += other.x;
    y += other.y;
    second += other.second;
    return *this;
  }
  LF_HD Moments& operator-=(const Moments& other) {
    mass -= other.mass;
    x -= other.x;
    y -= other.y;
    second -= other.second;
    return *this;
  }
};

/// A pixel's ρ and, at its left side, ∫ρ dx, ∫ρx dx and ∫ρx² dx from the left border.
struct DensityPixel {
  double value = 0.0;
  double mass = 0.0;
  double first = 0.0;
  double second = 0.0;
};

/// ∫ over heights y0 … y1 of a row whose integrals over all of x are `row`.
LF_HD inline Moments density_strip(const DensityPixel& row, double y0, double y1) {
  const double height = y1 - y0;
  const double middle = 0.5 * (y0 + y1);
  const double squares = height * (middle * middle + height * height / 12.0);
  return {row.mass * height, row.first * height, row.mass * height * middle,
          row.second * height + row.mass * squares};
}

/// What kernels read of a SummedDensity.
struct DensityView {
  int columns;
  int rows;
  const DensityPixel* pixels;    ///< Row by row.
  const DensityPixel* row_ends;  ///< Per row: the integrals at x = columns.
  const Moments* border;         ///< right_border() at every whole y, rows + 1 of them.

  [[nodiscard]] LF_HD double total() const { return border[rows].mass; }
  [[nodiscard]] LF_HD const DensityPixel& pixel(int column, int row) const {
    return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  }
  /// ∮ along the right border from y = 0 to `y`: all that lies between those heights.
  /// @pre 0 ≤ y ≤ rows.
  [[nodiscard]] LF_HD Moments right_border(double y) const {
    int row = static_cast<int>(y);
    row = row < 0 ? 0 : (row >= rows ? rows - 1 : row);
    Moments sum = border[row];
    sum += density_strip(row_ends[row], row, y);
    return sum;
  }
};

/// A density ρ, constant on every pixel [c, c+1] × [r, r+1] and zero outside of the picture, with
/// its integrals along rows from the left border: what Green's theorem needs to integrate over any
/// polygon by a walk along its edges, ∫ρ dA = ∮ F dy with F(x, y) = ∫₀ˣ ρ(x′, y) dx′.
class SummedDensity {
 public:
  /// Scales `picture` so that its integral is `total`.
  /// @pre no value is negative or not finite, their sum is positive, and so is `total`.
  SummedDensity(const Image& picture, double total);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  /// Integral over the whole picture.
  [[nodiscard]] double total() const { return border_.back().mass; }

  /// The arrays of DensityView.
  [[nodiscard]] std::span<const DensityPixel> pixels() const { return pixels_; }
  [[nodiscard]] std::span<const DensityPixel> row_ends() const { return row_ends_; }
  [[nodiscard]] std::span<const Moments> border() const { return border_; }
  [[nodiscard]] DensityView view() const {
    return {columns_, rows_, pixels_.data(), row_ends_.data(), border_.data()};
  }

 private:
  int columns_;
  int rows_;
  std::vector<DensityPixel> pixels_;
  std::vector<DensityPixel> row_ends_;
  std::vector<Moments> border_;
};

}  // namespace lensforge
