// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/bend_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/compute/float_bounds.h"

namespace lensforge {
namespace {

/// Cells at most: 32 MB.
constexpr double kMaxCells = 4e6;

}  // namespace

BendMap::BendMap(const OpticalSurface& surface, std::span<const BendRange> bends, double cell)
    : box_(surface.box()), cell_(std::max(cell, std::sqrt(box_.volume() / kMaxCells))) {
  columns_ = static_cast<std::int64_t>(box_.sizes().x() / cell_) + 1;
  rows_ = static_cast<std::int64_t>(box_.sizes().y() / cell_) + 1;
  cells_.assign(static_cast<std::size_t>(columns_ * rows_), {});
  const SurfaceMesh& mesh = surface.mesh();
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    Eigen::AlignedBox2d box;
    for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(t, k).head<2>()));
    const BendRange& range = bends[static_cast<std::size_t>(t)];
    const Cell bend{float_below(range.least), float_above(range.largest)};
    for (std::int64_t row = row_of(box.min().y()); row <= row_of(box.max().y()); ++row) {
      for (std::int64_t column = column_of(box.min().x()); column <= column_of(box.max().x());
           ++column) {
        Cell& to = cells_[static_cast<std::size_t>(row * columns_ + column)];
        to = {std::min(to.least, bend.least), std::max(to.largest, bend.largest)};
      }
    }
  }
}

std::int64_t BendMap::column_of(double x) const {
  const double column = std::floor((x - box_.min().x()) / cell_);
  return static_cast<std::int64_t>(std::clamp(column, 0.0, static_cast<double>(columns_ - 1)));
}

std::int64_t BendMap::row_of(double y) const {
  const double row = std::floor((y - box_.min().y()) / cell_);
  return static_cast<std::int64_t>(std::clamp(row, 0.0, static_cast<double>(rows_ - 1)));
}

BendRange BendMap::over(const Eigen::AlignedBox2d& box) const {
  Cell all;
  const std::int64_t last_row = row_of(box.max().y());
  const std::int64_t last_column = column_of(box.max().x());
  for (std::int64_t row = row_of(box.min().y()); row <= last_row; ++row) {
    for (std::int64_t column = column_of(box.min().x()); column <= last_column; ++column) {
      const Cell& cell = cells_[static_cast<std::size_t>(row * columns_ + column)];
      all = {std::min(all.least, cell.least), std::max(all.largest, cell.largest)};
    }
  }
  return {all.least, all.largest};
}

}  // namespace lensforge
