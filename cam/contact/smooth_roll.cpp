// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/smooth_roll.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/compute/scalar.h"

// Notation: p place of the axis, q contact, d = q − p, R radius, s = √(R² − |d|²) height of the
// centre above the contact, g = ∇f(q) = ∇z − d/s, H = ∇²f = ∇²z − (1 + d dᵀ/s²)/s.

namespace lensforge {
namespace {

/// Maximum number of cells: 64 MB.
constexpr double kMaxRollCells = 4e6;

/// Cells of one level along the side of one of the next.
constexpr std::int64_t kCoarser = 4;

/// Maximum cells that roughly_over() uses along the longer side of a box.
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
  Level fine = make_level(std::max(cell, std::sqrt(box_.volume() / kMaxRollCells)));
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

namespace {

/// Newton's method ends where |g| is below this: the tip is then exact to g²/(2m) ≤ 5e-11 mm for R
/// = 0.2 mm, m ≥ 0.2/R being the minimum downward curvature of f.
constexpr double kFlat = 1e-5;

/// Maximum number of steps; two are usual.
constexpr int kMaxRollSteps = 40;

/// Maximum distance of contacts from the axis, in radii.
constexpr double kFarthest = 0.98;

/// Curvature bounds are stored per cell. Maximum cell size, in ball radii and in mm.
constexpr double kRollCellPerRadius = 0.25;
constexpr double kLargestCell = 0.1;

/// Footprints are enlarged by this, mm: rounding.
constexpr double kRollMargin = 1e-6;

/// Maximum number of steps that narrow a footprint, and the share of it that must remain after a
/// step for it to be the last.
constexpr int kReachSteps = 8;
constexpr double kReachGain = 0.9;

using Fixed = std::array<bool, 2>;

/// Coordinates of the contact that the gradient holds at the rectangle's rim.
Fixed held_by_rim(const Eigen::Vector2d& q, const Eigen::Vector2d& gradient,
                  const Eigen::AlignedBox2d& box) {
  Fixed fixed{};
  for (int k = 0; k < 2; ++k) {
    fixed[static_cast<std::size_t>(k)] =
        (q[k] <= box.min()[k] && gradient[k] < 0.0) || (q[k] >= box.max()[k] && gradient[k] > 0.0);
  }
  return fixed;
}

/// x of H x = b with the fixed coordinates of x zero and their equations left out.
Eigen::Vector2d solve_free(const Eigen::Matrix2d& h, const Eigen::Vector2d& b, const Fixed& fixed) {
  if (fixed[0] && fixed[1]) return Eigen::Vector2d::Zero();
  if (fixed[0]) return {0.0, b.y() / h(1, 1)};
  if (fixed[1]) return {b.x() / h(0, 0), 0.0};
  const double det = h(0, 0) * h(1, 1) - h(0, 1) * h(1, 0);
  return Eigen::Vector2d(h(1, 1) * b.x() - h(0, 1) * b.y(), h(0, 0) * b.y() - h(1, 0) * b.x()) /
         det;
}

Eigen::AlignedBox2d grown(const Eigen::AlignedBox2d& box, double by) {
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(by);
  return {Eigen::Vector2d(box.min() - around), Eigen::Vector2d(box.max() + around)};
}

/// The box of the places of another box that are nearest to a box.
Eigen::AlignedBox2d clamped(const Eigen::AlignedBox2d& axis, const Eigen::AlignedBox2d& box) {
  return {nearest_inside(box, axis.min()), nearest_inside(box, axis.max())};
}

}  // namespace

SmoothBed::SmoothBed(const OpticalSurface& surface, double radius,
                     std::span<const SurfaceBounds> bounds)
    : surface_(surface),
      radius_(radius),
      bounds_(surface, bounds, std::min(kRollCellPerRadius * radius, kLargestCell)) {}

/// Closer places rise less, and a smaller rise brings the contact closer.
double SmoothBed::reach(const Eigen::AlignedBox2d& axis) const {
  const Eigen::AlignedBox2d over = clamped(axis, surface_.box());
  const double lowest = bounds_.roughly_over(over).lowest;
  double reach = radius_;
  for (int i = 0; i < kReachSteps; ++i) {
    const double rise = bounds_.roughly_over(grown(over, reach)).highest - lowest;
    const double next = std::sqrt(2.0 * radius_ * std::max(rise, 0.0)) + kRollMargin;
    const bool last = next > kReachGain * reach;
    reach = std::min(next, reach);
    if (last) break;
  }
  return reach;
}

Eigen::AlignedBox2d SmoothBed::footprint(const Eigen::AlignedBox2d& axis) const {
  return grown(clamped(axis, surface_.box()), reach(axis));
}

Eigen::AlignedBox2d SmoothBed::footprint(const Eigen::AlignedBox2d& axis, double tip) const {
  const auto holds = [&](const Eigen::AlignedBox2d& cell, const SurfaceBounds& bounds) {
    return bounds.highest + kRollMargin - tip >=
           axis.squaredExteriorDistance(cell) / (2.0 * radius_);
  };
  return bounds_.part_where(footprint(axis), holds);
}

double SmoothBed::tip_over(const Eigen::AlignedBox2d& axis, const Eigen::Vector3d& point) const {
  const Eigen::Vector2d q = point.head<2>();
  const Eigen::Vector2d farthest =
      (axis.min() - q).cwiseAbs().cwiseMax((axis.max() - q).cwiseAbs());
  const double room = radius_ * radius_ - farthest.squaredNorm();
  return room < 0.0 ? -HUGE_VAL : point.z() + std::sqrt(room) - radius_;
}

std::optional<SurfaceShape> SmoothRoll::shape_at(const Eigen::Vector2d& q) {
  if (!patch_ || !patch_->contains(q)) patch_ = bed_.surface().patch_at(q);
  if (!patch_) return std::nullopt;
  return patch_->at(q);
}

/// Newton's method with the step halved while f falls. Where the gradient points over the rim a
/// coordinate stays there. By concavity no other point of the surface holds the ball higher than
/// g²/(2m) above f(q), m = 1/R − bend.
std::optional<SmoothRoll::Rest> SmoothRoll::rest_at(double u, const Eigen::Vector2d& guess) {
  const Eigen::AlignedBox2d& box = bed_.surface().box();
  const double radius = bed_.radius();
  const double least_bend = (1.0 - SmoothBed::kMaxBend) / radius;
  const Eigen::Vector2d p = line_.at(u);
  Eigen::Vector2d q = nearest_inside(box, guess);
  Eigen::Vector2d before = nearest_inside(box, p);
  double height = -HUGE_VAL;
  for (int step = 0; step < kMaxRollSteps; ++step) {
    const Eigen::Vector2d d = q - p;
    const double s2 = radius * radius - d.squaredNorm();
    if (!(d.norm() < kFarthest * radius)) {
      if (q == before) return std::nullopt;
      q = 0.5 * (q + before);
      continue;
    }
    const std::optional<SurfaceShape> shape = shape_at(q);
    if (!shape) return std::nullopt;
    const double s = std::sqrt(s2);
    const double f = shape->z + s - radius;
    const Eigen::Vector2d gradient = shape->slope - d / s;
    const Fixed fixed = held_by_rim(q, gradient, box);
    const Eigen::Vector2d g(fixed[0] ? 0.0 : gradient.x(), fixed[1] ? 0.0 : gradient.y());
    const bool flat = g.squaredNorm() <= kFlat * kFlat;
    if (!flat && f < height) {
      q = 0.5 * (q + before);
      continue;
    }
    const Eigen::Matrix2d ball = -(Eigen::Matrix2d::Identity() + d * d.transpose() / s2) / s;
    const Eigen::Matrix2d bend = shape->bend + ball;
    if (flat) {
      const Eigen::Vector2d along =
          line_.along == 0 ? Eigen::Vector2d(1.0, 0.0) : Eigen::Vector2d(0.0, 1.0);
      return Rest{q, solve_free(bend, ball * along, fixed), shape->z, f,
                  g.squaredNorm() / (2.0 * least_bend)};
    }
    before = q;
    height = f;
    q = nearest_inside(box, q - solve_free(bend, g, fixed));
  }
  return std::nullopt;
}

/// Between the rests the contact moves by v du at most, v = ‖(∇²f)⁻¹ (1 + d dᵀ/s²)/s‖ ≤ (R/s) /
/// (1 − bR), so it lies in the box of both contacts with half of that around, and cannot be farther
/// from the axis than kSteepest as long as these are not.
std::optional<double> SmoothRoll::sharpest(double from, const Rest& first, double to,
                                           const Rest& last, double bend) const {
  const double radius = bed_.radius();
  const double steep = 1.0 / std::sqrt(1.0 - kSteepest * kSteepest);
  const double rate = steep / (1.0 - bend * radius);
  const double half = 0.5 * (to - from);
  const double out = std::max((first.q - line_.at(from)).norm(), (last.q - line_.at(to)).norm()) +
                     (1.0 + rate) * half;
  if (out > kSteepest * radius) return std::nullopt;
  Eigen::AlignedBox2d box(first.q);
  box.extend(last.q);
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(rate * half);
  box = {Eigen::Vector2d(box.min() - around), Eigen::Vector2d(box.max() + around)};
  const BendRange range = bed_.bounds().over(box).bend;
  const double up = range.largest / (1.0 - range.largest * radius);
  const double flank = radius * radius / std::pow(radius * radius - out * out, 1.5);
  const Eigen::AlignedBox2d& whole = bed_.surface().box();
  const bool rim = box.min()[line_.along] <= whole.min()[line_.along] ||
                   box.max()[line_.along] >= whole.max()[line_.along];
  return std::max({up, -range.least, rim ? flank : 0.0});
}

std::optional<CurveNodes> SmoothRoll::follow(double from, double to, double error, double apart) {
  Eigen::AlignedBox2d axis(line_.at(from));
  axis.extend(line_.at(to));
  const std::optional<Rest> first = rest_at(from, last_.value_or(line_.at(from)));
  if (!first) return std::nullopt;
  const std::optional<Rest> last = rest_at(to, first->q + (to - from) * first->rate);
  if (!last) return std::nullopt;
  // A stationary point of f was found over both places. It is the contact if it lies where contacts
  // are possible and f is concave there.
  const double tip =
      std::max(bed_.tip_over(axis, first->point()), bed_.tip_over(axis, last->point()));
  const Eigen::AlignedBox2d foot = bed_.footprint(axis, tip);
  const double bend = bed_.bounds().over(foot).bend.largest;
  if (bend * bed_.radius() > SmoothBed::kMaxBend) return std::nullopt;
  if (!foot.contains(first->q) || !foot.contains(last->q)) return std::nullopt;
  const std::optional<double> sharp = sharpest(from, *first, to, *last, bend);
  if (!sharp) return std::nullopt;
  // A chord of length h is off by bend · h²/8.
  const double densest = std::max(std::sqrt(*sharp / (8.0 * error)), 1.0 / apart);
  const double steps = std::max(1.0, std::ceil((to - from) * densest));
  CurveNodes nodes{{from}, {first->tip}, {first->q}, 0.0};
  double doubt = std::max(first->doubt, last->doubt);
  const double step = (to - from) / steps;
  Rest at = *first;
  for (double i = 1.0; i < steps; i += 1.0) {
    const double u = from + i * step;
    const std::optional<Rest> next = rest_at(u, at.q + (u - nodes.u.back()) * at.rate);
    if (!next || !foot.contains(next->q)) return std::nullopt;
    at = *next;
    doubt = std::max(doubt, at.doubt);
    nodes.u.push_back(u);
    nodes.z.push_back(at.tip);
    nodes.contact.push_back(at.q);
  }
  nodes.u.push_back(to);
  nodes.z.push_back(last->tip);
  nodes.contact.push_back(last->q);
  nodes.error = 0.125 * *sharp * step * step + doubt;
  last_ = last->q;
  return nodes;
}

}  // namespace lensforge
