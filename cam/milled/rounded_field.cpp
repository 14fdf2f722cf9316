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

TangentPlane plane_at(const SurfacePatch& patch, std::size_t node) {
  return {patch.z[node], {patch.slope_x[node], patch.slope_y[node]}};
}

}  // namespace

RoundedField::RoundedField(const SurfaceField& designed, const FacetGrid& grid,
                           const DropCutter& cutter, const Executor& executor)
    : designed_(designed),
      radius_(cutter.radius()),
      search_(LowestBallSearch(cutter)),
      reach_(FacetReach(grid, radius_, executor)) {}

RoundedField::RoundedField(const SurfaceField& designed, const CutSurface& cut, double error,
                           const Executor& executor)
    : designed_(designed), radius_(cut.radius()), error_(error), cut_(&cut) {
  if (cut.bed() != nullptr) smooth_reach_.emplace(*cut.bed(), executor);
}

void RoundedField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  designed_.sample(window, executor, patch);
  patch.depth.assign(patch.z.size(), 0.0);
  patch.width.assign(patch.z.size(), 0.0);
  if (cut_ == nullptr) {
    round(*search_, {{0, window.columns}, {0, window.rows}}, executor, patch);
    return;
  }
  const std::vector<Range> squares = squares_of(window);
  const auto round_square = [&](std::int64_t i) { round_facets_of(squares[index_of(i)], patch); };
  parallel_for(executor, "rounded squares", std::ssize(squares), round_square, 1);
}

/// Squares of kPatch, counted from (0, 0).
std::vector<RoundedField::Range> RoundedField::squares_of(const GridWindow& window) {
  const auto parts = [](std::int64_t count, const auto& at) {
    std::vector<std::pair<std::int64_t, std::int64_t>> found;
    const auto square_of = [&](std::int64_t i) { return std::floor(at(i) / kPatch); };
    for (std::int64_t begin = 0; begin < count;) {
      std::int64_t end = begin + 1;
      while (end < count && square_of(end) == square_of(begin)) ++end;
      found.emplace_back(begin, end);
      begin = end;
    }
    return found;
  };
  const auto columns = parts(window.columns, [&](std::int64_t i) { return window.x(i); });
  std::vector<Range> squares;
  for (const auto& rows : parts(window.rows, [&](std::int64_t j) { return window.y(j); })) {
    for (const auto& some : columns) squares.push_back({some, rows});
  }
  return squares;
}

/// Facets are made where nodes may be in a fillet, and for these alone.
void RoundedField::round_facets_of(const Range& range, SurfacePatch& patch) const {
  Eigen::AlignedBox2d doubtful;
  for (std::int64_t row = range.rows.first; row < range.rows.second; ++row) {
    for (std::int64_t i = range.columns.first; i < range.columns.second; ++i) {
      const std::size_t n = index_of(row * patch.window.columns + i);
      const Eigen::Vector2d q = patch.window.node(i, row);
      if (!surely_free(n, tangent_ball(q, plane_at(patch, n)), patch)) doubtful.extend(q);
    }
  }
  if (doubtful.isEmpty()) return;
  const Eigen::Vector2d around(radius_, radius_);
  const Executor serial = Executor::serial();
  const auto cutter = cut_->cutter({doubtful.min() - around, doubtful.max() + around}, serial);
  round(LowestBallSearch(*cutter, error_), range, serial, patch);
}

bool RoundedField::surely_free(std::size_t node, const Eigen::Vector3d& centre,
                               const SurfacePatch& patch) const {
  if (reach_) return reach_->surely_free(patch.cut[node], centre);
  return smooth_reach_ && smooth_reach_->surely_free(centre.head<2>());
}

Eigen::Vector3d RoundedField::tangent_ball(const Eigen::Vector2d& q,
                                           const TangentPlane& plane) const {
  const Eigen::Vector3d up(-plane.slope.x(), -plane.slope.y(), 1.0);
  return Eigen::Vector3d(q.x(), q.y(), plane.z) + radius_ * up.normalized();
}

void RoundedField::round(const LowestBallSearch& search, const Range& range,
                         const Executor& executor, SurfacePatch& patch) const {
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
      const TangentPlane plane = plane_at(patch, n);
      if (surely_free(n, tangent_ball(q, plane), patch)) continue;
      const LowestBall ball = search.over(q, plane, near);
      if (!(ball.z > plane.z)) continue;
      patch.z[n] = ball.z;
      const Eigen::Vector3d up = ball.centre - Eigen::Vector3d(q.x(), q.y(), ball.z);
      patch.slope_x[n] = -up.x() / up.z();
      patch.slope_y[n] = -up.y() / up.z();
      if (!patch.cut.empty()) patch.cut[n] = kFillet;
      patch.depth[n] = ball.z - plane.z;
      patch.width[n] = ball.spread;
    }
  };
  parallel_for(executor, "rounded surface", runs * rows, round_run, 1);
}

}  // namespace lensforge
