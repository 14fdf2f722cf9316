// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/rounded_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lensforge {
namespace {

/// Nodes of a row that are rounded one after the other, so that each begins where the last was
/// held.
constexpr std::int64_t kRun = 256;

std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

}  // namespace

RoundedField::RoundedField(const FacetField& designed, const DropCutter& cutter,
                           const Executor& executor)
    : designed_(designed),
      radius_(cutter.radius()),
      search_(LowestBallSearch(cutter)),
      reach_(FacetReach(designed.grid(), radius_, executor)) {}

RoundedField::RoundedField(const SurfaceField& designed, const CutSurface& cut, double error)
    : designed_(designed), radius_(cut.radius()), error_(error), cut_(&cut) {}

void RoundedField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  CreasePatch creases;
  sample(window, executor, patch, creases);
}

void RoundedField::sample(const GridWindow& window, const Executor& executor, SurfacePatch& patch,
                          CreasePatch& creases) const {
  designed_.sample(window, executor, patch);
  creases.depth.assign(patch.z.size(), 0.0);
  creases.width.assign(patch.z.size(), 0.0);
  if (cut_ == nullptr) {
    round(*search_, {{0, window.columns}, {0, window.rows}}, executor, patch, creases);
    return;
  }
  // Squares are laid from (0, 0), so that a node's facets do not depend on the window.
  const auto square_of = [](double x) { return std::floor(x / kPatch); };
  const auto end_of = [&](std::int64_t begin, std::int64_t count, const auto& at) {
    std::int64_t end = begin + 1;
    while (end < count && square_of(at(end)) == square_of(at(begin))) ++end;
    return end;
  };
  const auto x = [&](std::int64_t i) { return window.x(i); };
  const auto y = [&](std::int64_t j) { return window.y(j); };
  for (std::int64_t row = 0; row < window.rows;) {
    const std::int64_t row_end = end_of(row, window.rows, y);
    for (std::int64_t column = 0; column < window.columns;) {
      const std::int64_t column_end = end_of(column, window.columns, x);
      const Eigen::Vector2d corner(square_of(x(column)) * kPatch, square_of(y(row)) * kPatch);
      round_facets_of({{column, column_end}, {row, row_end}},
                      {corner, corner + Eigen::Vector2d(kPatch, kPatch)}, executor, patch, creases);
      column = column_end;
    }
    row = row_end;
  }
}

void RoundedField::round_facets_of(const Range& range, const Eigen::AlignedBox2d& box,
                                   const Executor& executor, SurfacePatch& patch,
                                   CreasePatch& creases) const {
  const Eigen::Vector2d around(radius_, radius_);
  const auto cutter = cut_->cutter({box.min() - around, box.max() + around}, executor);
  round(LowestBallSearch(*cutter, error_), range, executor, patch, creases);
}

void RoundedField::round(const LowestBallSearch& search, const Range& range,
                         const Executor& executor, SurfacePatch& patch,
                         CreasePatch& creases) const {
  const std::int64_t columns = range.columns.second - range.columns.first;
  const std::int64_t rows = range.rows.second - range.rows.first;
  const std::int64_t runs = (columns + kRun - 1) / kRun;
  const auto round_run = [&](std::int64_t run) {
    const std::int64_t row = range.rows.first + run / runs;
    const std::int64_t begin = range.columns.first + run % runs * kRun;
    CutterLocation near;
    for (std::int64_t i = begin; i < std::min(range.columns.second, begin + kRun); ++i) {
      const std::size_t n = index_of(row * patch.window.columns + i);
      const Eigen::Vector2d q = patch.window.node(i, row);
      const TangentPlane plane{patch.z[n], {patch.slope_x[n], patch.slope_y[n]}};
      const Eigen::Vector3d normal =
          Eigen::Vector3d(-plane.slope.x(), -plane.slope.y(), 1.0).normalized();
      const Eigen::Vector3d tangent = Eigen::Vector3d(q.x(), q.y(), plane.z) + radius_ * normal;
      if (reach_ && reach_->surely_free(patch.cut[n], tangent)) continue;
      const LowestBall ball = search.over(q, plane, near);
      if (!(ball.z > plane.z)) continue;
      patch.z[n] = ball.z;
      const Eigen::Vector3d up = ball.centre - Eigen::Vector3d(q.x(), q.y(), ball.z);
      patch.slope_x[n] = -up.x() / up.z();
      patch.slope_y[n] = -up.y() / up.z();
      if (!patch.cut.empty()) patch.cut[n] = kFillet;
      creases.depth[n] = ball.z - plane.z;
      creases.width[n] = ball.spread;
    }
  };
  parallel_for(executor, "rounded surface", runs * rows, round_run, 1);
}

}  // namespace lensforge
