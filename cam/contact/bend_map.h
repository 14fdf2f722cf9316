// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/surface/optical_surface.h"

namespace lensforge {

/// How sharply a smooth surface bends where, in cells.
class BendMap {
 public:
  /// @param bends  OpticalSurface::bend_range() of every triangle.
  /// @param cell   side of a cell, mm, > 0; larger where the surface has too many of them.
  BendMap(const OpticalSurface& surface, std::span<const BendRange> bends, double cell);

  /// Bounds of the second derivatives in any direction, 1/mm, over all of the surface in a box;
  /// zeros where there is none.
  [[nodiscard]] BendRange over(const Eigen::AlignedBox2d& box) const;

 private:
  /// In single precision, rounded outwards.
  struct Cell {
    float least = 0.0F, largest = 0.0F;
  };
  [[nodiscard]] std::int64_t column_of(double x) const;
  [[nodiscard]] std::int64_t row_of(double y) const;

  Eigen::AlignedBox2d box_;
  double cell_;
  std::int64_t columns_ = 1;
  std::int64_t rows_ = 1;
  std::vector<Cell> cells_;
};

}  // namespace lensforge
