// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/surface/optical_surface.h"

namespace lensforge {

/// Bounds over a part of a smooth surface.
struct SurfaceBounds {
  BendRange bend;
  double lowest = 0.0;   ///< mm
  double highest = 0.0;  ///< mm
};

/// How a smooth surface bends and how high it is where, in cells, and in cells of those.
class BoundsMap {
 public:
  /// @param bounds  of every triangle.
  /// @param cell    side of a cell, mm, > 0; larger where the surface has too many of them.
  BoundsMap(const OpticalSurface& surface, std::span<const SurfaceBounds> bounds, double cell);

  /// Bounds over all of the surface in a box. @pre some of it is there.
  [[nodiscard]] SurfaceBounds over(const Eigen::AlignedBox2d& box) const;
  /// The same, from larger cells where the box has many: quicker, and at most as close.
  [[nodiscard]] SurfaceBounds roughly_over(const Eigen::AlignedBox2d& box) const;
  /// The box of those cells over a box in which `holds(cell's box, its bounds)`; empty if in none.
  template <class Holds>
  [[nodiscard]] Eigen::AlignedBox2d part_where(const Eigen::AlignedBox2d& box,
                                               const Holds& holds) const {
    const Level& level = levels_.front();
    const auto [begin, end] = range_of(level, box);
    Eigen::AlignedBox2d part;
    for (std::int64_t row = begin.y(); row <= end.y(); ++row) {
      for (std::int64_t column = begin.x(); column <= end.x(); ++column) {
        const Cell& cell = level.cells[static_cast<std::size_t>(row * level.columns + column)];
        const Eigen::AlignedBox2d own = box_of(level, column, row);
        if (holds(own, cell.bounds())) part.extend(own);
      }
    }
    return part;
  }

 private:
  /// In single precision, rounded outwards.
  struct Cell {
    float least = 0.0F, largest = 0.0F, lowest = HUGE_VALF, highest = -HUGE_VALF;
    void extend(const Cell& other);
    [[nodiscard]] SurfaceBounds bounds() const { return {{least, largest}, lowest, highest}; }
  };
  struct Level {
    double cell = 0.0;  ///< Side, mm.
    std::int64_t columns = 1;
    std::int64_t rows = 1;
    std::vector<Cell> cells;
  };
  /// Cells [begin, end] along x and y.
  struct Range {
    Eigen::Array2<std::int64_t> begin, end;
  };
  [[nodiscard]] Level make_level(double cell) const;
  [[nodiscard]] Eigen::AlignedBox2d box_of(const Level& level, std::int64_t column,
                                           std::int64_t row) const {
    const Eigen::Vector2d corner =
        box_.min() +
        level.cell * Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row));
    return {corner, Eigen::Vector2d(corner + Eigen::Vector2d::Constant(level.cell))};
  }
  [[nodiscard]] Range range_of(const Level& level, const Eigen::AlignedBox2d& box) const;
  [[nodiscard]] SurfaceBounds over(const Level& level, const Eigen::AlignedBox2d& box) const;

  Eigen::AlignedBox2d box_;
  std::vector<Level> levels_;  ///< From the finest on.
};

}  // namespace lensforge
