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
      search_(cutter),
      reach_(FacetReach(designed.grid(), radius_, executor)) {}

RoundedField::RoundedField(const SurfaceField& designed, const DropCutter& cutter, double error)
    : designed_(designed), radius_(cutter.radius()), search_(cutter, error) {}

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
  const std::int64_t runs = (window.columns + kRun - 1) / kRun;
  const auto round_run = [&](std::int64_t run) {
    const std::int64_t row = run / runs;
    const std::int64_t end = std::min(window.columns, (run % runs + 1) * kRun);
    CutterLocation near;
    for (std::int64_t column = run % runs * kRun; column < end; ++column) {
      const std::size_t n = index_of(row * window.columns + column);
      const Eigen::Vector2d q = window.node(column, row);
      const TangentPlane plane{patch.z[n], {patch.slope_x[n], patch.slope_y[n]}};
      const Eigen::Vector3d normal =
          Eigen::Vector3d(-plane.slope.x(), -plane.slope.y(), 1.0).normalized();
      const Eigen::Vector3d tangent = Eigen::Vector3d(q.x(), q.y(), plane.z) + radius_ * normal;
      if (reach_ && reach_->surely_free(patch.cut[n], tangent)) continue;
      const LowestBall ball = search_.over(q, plane, near);
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
  parallel_for(executor, "rounded surface", runs * window.rows, round_run, 1);
}

}  // namespace lensforge
