// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/ball_blend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace lensforge {
namespace {

/// Maximum number of cells: 64 MB.
constexpr double kMaxCells = 1.6e7;

/// Margin around the axis of a ball that touches a cell, mm: rows are checked in stretches that may
/// extend slightly beyond.
constexpr double kMargin = 0.02;

/// Share of the maximum curvature that the ball can roll along; places with more are left as well.
constexpr double kSafe = 0.95;

/// Box of the axis of a ball that touches the surface somewhere in a box: R n beside the contact, n
/// being the normal seen from above, which turns by at most the surface's curvature.
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

/// Four neighbouring cells with the weights of a uniform cubic B-spline.
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
  const std::int64_t row = cell / columns_;
  const Eigen::Vector2d corner =
      box_.min() +
      cell_ * Eigen::Vector2d(static_cast<double>(cell % columns_), static_cast<double>(row));
  const Eigen::Vector2d end = corner + Eigen::Vector2d::Constant(cell_);
  return {nearest_inside(box_, corner), nearest_inside(box_, end)};
}

/// Spreads distances from every cell that is left to those around it.
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

/// A uniform cubic B-spline of the cells' values: a path lifted by it has no corners.
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

namespace {

/// Places of a row of the smaller ball at which profiles are summed: their mean is then exact to
/// 1e-5 of a scallop.
constexpr int kPlaces = 128;

/// Values of a table over the zone, interpolated linearly.
constexpr std::size_t kTable = 257;

/// Halvings: to the last bit.
constexpr int kHalvings = 60;

/// Curvature of the smaller ball's path out of the zone, 1/mm: no more than that of a lens, and at
/// the end of its row 6 µm above the surface, more than that rises over the row's level end.
constexpr double kExit = 0.15;

/// From 0 at 0 to 1 at 1, level at both.
double eased(double t) { return t * t * (3.0 - 2.0 * t); }

/// Scallops over one row of the larger ball.
struct Profiles {
  std::vector<double> small;
  std::vector<double> large;

  explicit Profiles(const BallBlend::Rows& rows) {
    const double period = rows.every * rows.pitch;
    const int places = kPlaces * rows.every;
    for (int i = 0; i < places; ++i) {
      const double x = period * (i + 0.5) / places;
      const double from_small = std::remainder(x, rows.pitch);
      const double from_large = std::remainder(x, period);
      small.push_back(from_small * from_small / (2.0 * rows.small_radius));
      large.push_back(from_large * from_large / (2.0 * rows.large_radius));
    }
  }

  [[nodiscard]] double mean_of_lower(double small_lift, double large_lift) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < small.size(); ++i) {
      sum += std::min(small[i] + small_lift, large[i] + large_lift);
    }
    return sum / static_cast<double>(small.size());
  }
};

/// Lift of the larger ball that gives the wanted mean; the mean grows with the lift.
double lift_for(const Profiles& profiles, double small_lift, double mean, double low, double high) {
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (profiles.mean_of_lower(small_lift, middle) < mean ? low : high) = middle;
  }
  return high;
}

}  // namespace

BallBlend::BallBlend(const Rows& rows) {
  const double crest = rows.pitch * rows.pitch / (8.0 * rows.small_radius);
  const double large_pitch = rows.every * rows.pitch;
  const double large_crest = large_pitch * large_pitch / (8.0 * rows.large_radius);
  const double mean = crest / 3.0;
  const double alone = mean - large_crest / 3.0;  // Of the larger ball where it cuts alone.
  clear_ = std::max(alone, 0.0) + large_crest;
  const Profiles profiles(rows);
  for (std::size_t i = 0; i < kTable; ++i) {
    const double t = static_cast<double>(i) / (kTable - 1);
    const double small = clear_ * eased(t);
    const double lift = lift_for(profiles, small, mean, alone, crest + large_crest);
    large_lift_.push_back(std::max(i == 0 ? crest : lift, 0.0));
  }
}

double BallBlend::small_lift(double distance) const {
  const double t = std::clamp(distance / kWidth, 0.0, 1.0);
  const double out = std::max(distance - kWidth, 0.0);
  return clear_ * eased(t) + kExit * out * out;
}

double BallBlend::large_lift(double distance) const {
  const double at = std::clamp(distance / kWidth, 0.0, 1.0) * (kTable - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kTable - 2);
  const double part = at - static_cast<double>(i);
  return (1.0 - part) * large_lift_[i] + part * large_lift_[i + 1];
}

}  // namespace lensforge
