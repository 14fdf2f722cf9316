// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/smooth_reach.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lensforge {
namespace {

/// Side of the cells, in radii.
constexpr double kCellPerRadius = 0.25;

/// Cells at most: 16 MB.
constexpr double kMaxCells = 1.6e7;

/// Boxes are this much larger than cells, mm: rounding of a centre's cell.
constexpr double kMargin = 1e-6;

}  // namespace

SmoothReach::SmoothReach(const SmoothBed& bed, const Executor& executor)
    : box_(bed.surface().box()) {
  const double radius = bed.radius();
  cell_ = std::max(kCellPerRadius * radius, std::sqrt(box_.volume() / kMaxCells));
  columns_ = static_cast<std::int64_t>(box_.sizes().x() / cell_) + 1;
  rows_ = static_cast<std::int64_t>(box_.sizes().y() / cell_) + 1;
  free_.resize(static_cast<std::size_t>(columns_ * rows_));
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(kMargin);
  const auto judge = [&](std::int64_t i) {
    const Eigen::Vector2d corner =
        box_.min() + cell_ * Eigen::Vector2d(static_cast<double>(i % columns_),
                                             static_cast<double>(i / columns_));
    const Eigen::AlignedBox2d under(
        Eigen::Vector2d(corner - around),
        Eigen::Vector2d(corner + Eigen::Vector2d::Constant(cell_) + around));
    const double bend = bed.bounds().over(bed.footprint(under)).bend.largest;
    free_[static_cast<std::size_t>(i)] = bend * radius < 1.0 ? 1 : 0;
  };
  parallel_for(executor, "reach of the ball", columns_ * rows_, judge);
}

/// A centre beyond the rim belongs to the outermost cell, around which lies all of the surface that
/// its ball can touch.
std::int64_t SmoothReach::cell_of(double at, double begin, double cell, std::int64_t cells) {
  const double place = std::floor((at - begin) / cell);
  return static_cast<std::int64_t>(std::clamp(place, 0.0, static_cast<double>(cells - 1)));
}

}  // namespace lensforge
