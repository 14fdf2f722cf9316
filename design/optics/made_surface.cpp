// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/made_surface.h"

#include <cstddef>
#include <cstdint>

namespace lensforge {
namespace {

Eigen::Matrix2d plan_of(const SplineFrame& frame) {
  Eigen::Matrix2d plan;
  plan << frame.by_u.head<2>(), frame.by_v.head<2>();
  return plan;
}

}  // namespace

MadeSurface::MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor)
    : grid_({net.points.row(0).maxCoeff(), net.points.row(1).maxCoeff()}, made),
      heights_(grid_.make_heights()) {
  const auto sample = [&](std::int64_t row) { sample_row(net, static_cast<int>(row)); };
  parallel_for(executor, "heights to polish", grid_.cells().y() + 1, sample, 1);
  AveragingGrid::turn_about_rim(heights_);
}

/// Newton's method from the sample before, and the Taylor series over what it leaves.
void MadeSurface::sample_row(const ControlNet& net, int row) {
  constexpr int kSteps = 2;
  constexpr int kReach = GaussianWeights::kReach;
  const Eigen::Vector2d high = net.cells().cast<double>();
  Eigen::Vector2d uv =
      net.parameters_of(grid_.place(0, row), {0.0, high.y() * row / grid_.cells().y()});
  SplineFrame frame = net.at(uv);
  for (int i = 0; i <= grid_.cells().x(); ++i) {
    const Eigen::Vector2d xy = grid_.place(i, row);
    for (int step = 0; step < kSteps; ++step) {
      uv += plan_of(frame).inverse() * (xy - frame.point.head<2>());
      uv = uv.cwiseMax(0.0).cwiseMin(high);
      frame = net.at(uv);
    }
    const SurfaceShape shape = frame.shape();
    const Eigen::Vector2d rest = xy - frame.point.head<2>();
    heights_(i + kReach, row + kReach) =
        shape.z + rest.dot(shape.slope) + 0.5 * rest.dot(shape.bend * rest);
  }
}

SurfacePoint MadeSurface::at(const Eigen::Vector2d& xy) const {
  const GaussianWeights x = grid_.weights(xy.x(), 0);
  const GaussianWeights y = grid_.weights(xy.y(), 1);
  const Eigen::Index first = grid_.first_sample(xy.y(), 1);
  SurfacePoint made;
  for (std::size_t n = 0; n < GaussianWeights::kCount; ++n) {
    const double* const z =
        &heights_(grid_.first_sample(xy.x(), 0), first + static_cast<Eigen::Index>(n));
    double value = 0.0;
    double slope = 0.0;
    for (std::size_t m = 0; m < GaussianWeights::kCount; ++m) {
      value += x.value[m] * z[m];
      slope += x.slope[m] * z[m];
    }
    made.z += y.value[n] * value;
    made.slope += Eigen::Vector2d(y.value[n] * slope, y.slope[n] * value);
  }
  const AveragingGrid::RimLoss loss = grid_.rim_loss(xy);
  made.z -= loss.z;
  made.slope -= loss.slope;
  return made;
}

SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor) {
  SampledSurface nodes = spline_nodes(net, samples);
  const MadeSurface surface(net, made, executor);
  const auto make = [&](std::int64_t i) {
    const SurfacePoint point = surface.at(nodes.mesh.vertices.col(i).head<2>());
    nodes.mesh.vertices(2, i) = point.z;
    nodes.normals.col(i) << -point.slope, 1.0;
  };
  parallel_for(executor, "made nodes", nodes.mesh.vertex_count(), make);
  return nodes;
}

}  // namespace lensforge
