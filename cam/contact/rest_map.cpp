// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/rest_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace lensforge {
namespace {

/// Cells at most: 64 MB.
constexpr double kMaxCells = 1.6e7;

/// Of where the axis may be when the ball touches a cell, mm: rows are judged in stretches that may
/// reach a little beyond.
constexpr double kMargin = 0.02;

/// Places where bends come this near to what the ball rolls along at most are left as well.
constexpr double kSafe = 0.95;

/// Where the axis of a ball is that touches the surface somewhere in a box: over the contact by R
/// n, n being the normal seen from above, which turns by no more than the surface bends.
Eigen::AlignedBox2d axis_over(const SmoothBed& bed, const Eigen::AlignedBox2d& box,
                              const Eigen::Vector2d& slope) {
  const BendRange bend = bed.bounds().over(box).bend;
  const double sharpest = std::max(std::abs(bend.least), std::abs(bend.largest));
  const double half = 0.5 * box.diagonal().norm();
  const double around = (1.0 + bed.radius() * sharpest) * half + kMargin;
  const double secant = std::sqrt(1.0 + slope.squaredNorm());
  const Eigen::Vector2d axis = box.center() - bed.radius() / secant * slope;
  const Eigen::Vector2d all = Eigen::Vector2d::Constant(around);
  return {Eigen::Vector2d(axis - all), Eigen::Vector2d(axis + all)};
}

bool rolls_over(const SmoothBed& bed, const Eigen::AlignedBox2d& box) {
  const Eigen::Vector2d q = box.center();
  const std::optional<SurfacePoint> middle = bed.surface().at(q);
  if (!middle) return false;
  const Eigen::AlignedBox2d axis = axis_over(bed, box, middle->slope);
  const double tip = bed.tip_over(axis, {q.x(), q.y(), middle->z});
  const double bend = bed.bounds().over(bed.footprint(axis, tip)).bend.largest;
  return bend * bed.radius() <= kSafe * SmoothBed::kMaxBend;
}

/// Four cells in a row with the weights of a uniform cubic B-spline.
struct SplinePart {
  std::array<std::int64_t, 4> cell{};
  std::array<double, 4> weight{};

  SplinePart(double at, std::int64_t count) {
    const double inside = std::clamp(at, 0.0, static_cast<double>(count - 1));
    const double first = std::floor(inside);
    const double t = inside - first;
    const double s = 1.0 - t;
    weight = {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
              (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
    for (std::size_t k = 0; k < 4; ++k) {
      const std::int64_t place =
          static_cast<std::int64_t>(first) + static_cast<std::int64_t>(k) - 1;
      cell[k] = std::clamp<std::int64_t>(place, 0, count - 1);
    }
  }
};

}  // namespace

RestMap::RestMap(const SmoothBed& bed, double reach, const Executor& executor)
    : box_(bed.surface().box()), cell_(std::max(kCell, std::sqrt(box_.volume() / kMaxCells))) {
  columns_ = static_cast<std::int64_t>(box_.sizes().x() / cell_) + 1;
  rows_ = static_cast<std::int64_t>(box_.sizes().y() / cell_) + 1;
  std::vector<std::uint8_t> left(static_cast<std::size_t>(columns_ * rows_));
  parallel_for(executor, "rest of the larger ball", columns_ * rows_, [&](std::int64_t i) {
    left[static_cast<std::size_t>(i)] = rolls_over(bed, box_of(i)) ? 0 : 1;
  });
  distance_.assign(left.size(), static_cast<float>(reach));
  spread(static_cast<std::int64_t>(reach / cell_) + 1, left);
}

Eigen::AlignedBox2d RestMap::box_of(std::int64_t cell) const {
  const Eigen::Vector2d corner =
      box_.min() + cell_ * Eigen::Vector2d(static_cast<double>(cell % columns_),
                                           static_cast<double>(cell / columns_));
  const Eigen::Vector2d end = corner + Eigen::Vector2d::Constant(cell_);
  return {nearest_inside(box_, corner), nearest_inside(box_, end)};
}

/// From every cell that is left to those around it.
void RestMap::spread(std::int64_t reach_cells, const std::vector<std::uint8_t>& left) {
  const auto index = [&](std::int64_t column, std::int64_t row) {
    return static_cast<std::size_t>(row * columns_ + column);
  };
  for (std::int64_t row = 0; row < rows_; ++row) {
    for (std::int64_t column = 0; column < columns_; ++column) {
      if (left[index(column, row)] == 0) continue;
      distance_[index(column, row)] = 0.0F;
      const std::int64_t low = std::max<std::int64_t>(row - reach_cells, 0);
      const std::int64_t high = std::min(row + reach_cells, rows_ - 1);
      const std::int64_t begin = std::max<std::int64_t>(column - reach_cells, 0);
      const std::int64_t end = std::min(column + reach_cells, columns_ - 1);
      for (std::int64_t j = low; j <= high; ++j) {
        for (std::int64_t i = begin; i <= end; ++i) {
          const double cells =
              std::hypot(static_cast<double>(i - column), static_cast<double>(j - row));
          float& to = distance_[index(i, j)];
          to = std::min(to, static_cast<float>(cells * cell_));
        }
      }
    }
  }
}

/// A uniform cubic B-spline with the cells' values: a path that is lifted by it has no corners.
double RestMap::distance(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d at = (place - box_.min()) / cell_ - Eigen::Vector2d::Constant(0.5);
  const SplinePart x(at.x(), columns_);
  const SplinePart y(at.y(), rows_);
  double sum = 0.0;
  for (std::size_t j = 0; j < 4; ++j) {
    double row = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      row += x.weight[i] *
             double{distance_[static_cast<std::size_t>(y.cell[j] * columns_ + x.cell[i])]};
    }
    sum += y.weight[j] * row;
  }
  return sum;
}

double RestMap::share_within(double distance) const {
  const auto near = std::count_if(distance_.begin(), distance_.end(),
                                  [&](float d) { return double{d} <= distance; });
  return static_cast<double>(near) / static_cast<double>(distance_.size());
}

}  // namespace lensforge
