// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/bounds_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/compute/float_bounds.h"

namespace lensforge {
namespace {

/// Cells at most: 64 MB.
constexpr double kMaxCells = 4e6;

/// Cells of one level along the side of one of the next.
constexpr std::int64_t kCoarser = 4;

/// Cells along the longer side of a box that roughly_over() looks at at most.
constexpr double kRoughCells = 6.0;

}  // namespace

void BoundsMap::Cell::extend(const Cell& other) {
  least = std::min(least, other.least);
  largest = std::max(largest, other.largest);
  lowest = std::min(lowest, other.lowest);
  highest = std::max(highest, other.highest);
}

BoundsMap::BoundsMap(const OpticalSurface& surface, std::span<const SurfaceBounds> bounds,
                     double cell)
    : box_(surface.box()) {
  Level fine = make_level(std::max(cell, std::sqrt(box_.volume() / kMaxCells)));
  const SurfaceMesh& mesh = surface.mesh();
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    Eigen::AlignedBox2d box;
    for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(t, k).head<2>()));
    const SurfaceBounds& of = bounds[static_cast<std::size_t>(t)];
    const Cell own{float_below(of.bend.least), float_above(of.bend.largest), float_below(of.lowest),
                   float_above(of.highest)};
    const auto [begin, end] = range_of(fine, box);
    for (std::int64_t row = begin.y(); row <= end.y(); ++row) {
      for (std::int64_t column = begin.x(); column <= end.x(); ++column) {
        fine.cells[static_cast<std::size_t>(row * fine.columns + column)].extend(own);
      }
    }
  }
  levels_.push_back(std::move(fine));
  while (std::max(levels_.back().columns, levels_.back().rows) > kCoarser) {
    const Level& last = levels_.back();
    Level next = make_level(last.cell * kCoarser);
    for (std::int64_t row = 0; row < last.rows; ++row) {
      for (std::int64_t column = 0; column < last.columns; ++column) {
        const std::int64_t to = row / kCoarser * next.columns + column / kCoarser;
        next.cells[static_cast<std::size_t>(to)].extend(
            last.cells[static_cast<std::size_t>(row * last.columns + column)]);
      }
    }
    levels_.push_back(std::move(next));
  }
}

BoundsMap::Level BoundsMap::make_level(double cell) const {
  Level level{cell,
              static_cast<std::int64_t>(box_.sizes().x() / cell) + 1,
              static_cast<std::int64_t>(box_.sizes().y() / cell) + 1,
              {}};
  level.cells.resize(static_cast<std::size_t>(level.columns * level.rows));
  return level;
}

BoundsMap::Range BoundsMap::range_of(const Level& level, const Eigen::AlignedBox2d& box) const {
  const Eigen::Array2d last(static_cast<double>(level.columns - 1),
                            static_cast<double>(level.rows - 1));
  const auto cell_of = [&](const Eigen::Vector2d& place) {
    const Eigen::Array2d cell = ((place - box_.min()).array() / level.cell).floor();
    return Eigen::Array2<std::int64_t>(cell.max(0.0).min(last).cast<std::int64_t>());
  };
  return {cell_of(box.min()), cell_of(box.max())};
}

SurfaceBounds BoundsMap::over(const Level& level, const Eigen::AlignedBox2d& box) const {
  Cell all;
  const auto [begin, end] = range_of(level, box);
  for (std::int64_t row = begin.y(); row <= end.y(); ++row) {
    for (std::int64_t column = begin.x(); column <= end.x(); ++column) {
      all.extend(level.cells[static_cast<std::size_t>(row * level.columns + column)]);
    }
  }
  return all.bounds();
}

SurfaceBounds BoundsMap::over(const Eigen::AlignedBox2d& box) const {
  return over(levels_.front(), box);
}

SurfaceBounds BoundsMap::roughly_over(const Eigen::AlignedBox2d& box) const {
  std::size_t level = 0;
  const double side = box.sizes().maxCoeff();
  while (level + 1 < levels_.size() && side > kRoughCells * levels_[level].cell) ++level;
  return over(levels_[level], box);
}

}  // namespace lensforge
