// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/made_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lensforge {
namespace {

/// Between samples of heights, in σ. A sum over a Gaussian has a wave of wave number k right to
/// exp(−(2π/0.75 − kσ)²/2).
constexpr double kSpacing = 0.75;

/// Samples to both sides that an average counts: 5.25 σ.
constexpr int kReach = 7;

constexpr double kMaxSamples = 1e8;

Eigen::Matrix2d plan_of(const SplineFrame& frame) {
  Eigen::Matrix2d plan;
  plan << frame.by_u.head<2>(), frame.by_v.head<2>();
  return plan;
}

}  // namespace

struct MadeSurface::Weights {
  static constexpr std::size_t kCount = 2 * kReach + 2;
  std::array<double, kCount> value{};
  std::array<double, kCount> slope{};  ///< Of the average's derivative, 1/mm.

  /// @param offset  of the first sample from the place, mm.
  Weights(double offset, double step, double sigma) {
    std::array<double, kCount> apart{};
    double sum = 0.0;
    for (std::size_t k = 0; k < kCount; ++k) {
      apart[k] = offset + static_cast<double>(k) * step;
      value[k] = std::exp(-0.5 * std::pow(apart[k] / sigma, 2));
      sum += value[k];
    }
    double mean = 0.0;
    for (std::size_t k = 0; k < kCount; ++k) {
      value[k] /= sum;
      mean += value[k] * apart[k];
    }
    // A constant has no slope, and a straight line its own.
    double moment = 0.0;
    for (std::size_t k = 0; k < kCount; ++k) {
      slope[k] = value[k] * (apart[k] - mean);
      moment += slope[k] * apart[k];
    }
    for (double& s : slope) s /= moment;
  }
};

MadeSurface::MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor)
    : made_(made), size_(net.points.row(0).maxCoeff(), net.points.row(1).maxCoeff()) {
  const double across = std::hypot(made.polish_sigma, made.pitch / std::sqrt(12.0));
  sigma_ = {made.polish_sigma, across};
  if (!made.rows_along_x) sigma_.reverseInPlace();
  const Eigen::Array2d wanted = size_.array() / (kSpacing * sigma_.array());
  cells_ = wanted.ceil().cast<int>().max(kReach);
  step_ = size_.array() / cells_.cast<double>().array();
  height_.resize(cells_.x() + 1 + 2 * kReach, cells_.y() + 1 + 2 * kReach);
  const auto sample = [&](std::int64_t row) { sample_row(net, static_cast<int>(row)); };
  parallel_for(executor, "heights to polish", cells_.y() + 1, sample, 1);
  turn_about_rim();
}

double MadeSurface::least_sigma(const Eigen::Vector2d& size) {
  return std::sqrt(size.prod() / kMaxSamples) / kSpacing;
}

/// Newton's method from the sample before, and the Taylor series over what it leaves.
void MadeSurface::sample_row(const ControlNet& net, int row) {
  constexpr int kSteps = 2;
  const Eigen::Vector2d high = net.cells().cast<double>();
  Eigen::Vector2d uv =
      net.parameters_of({0.0, row * step_.y()}, {0.0, high.y() * row / cells_.y()});
  SplineFrame frame = net.at(uv);
  for (int i = 0; i <= cells_.x(); ++i) {
    const Eigen::Vector2d xy = step_.cwiseProduct(Eigen::Vector2d(i, row));
    for (int step = 0; step < kSteps; ++step) {
      uv += plan_of(frame).inverse() * (xy - frame.point.head<2>());
      uv = uv.cwiseMax(0.0).cwiseMin(high);
      frame = net.at(uv);
    }
    const SurfaceShape shape = frame.shape();
    const Eigen::Vector2d rest = xy - frame.point.head<2>();
    height_(i + kReach, row + kReach) =
        shape.z + rest.dot(shape.slope) + 0.5 * rest.dot(shape.bend * rest);
  }
}

/// f(−x) = 2 f(0) − f(x) at a rim x = 0.
void MadeSurface::turn_about_rim() {
  const Eigen::Index right = kReach + cells_.x();
  const Eigen::Index top = kReach + cells_.y();
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    height_.row(kReach - k) = 2.0 * height_.row(kReach) - height_.row(kReach + k);
    height_.row(right + k) = 2.0 * height_.row(right) - height_.row(right - k);
  }
  for (Eigen::Index k = 1; k <= kReach; ++k) {
    height_.col(kReach - k) = 2.0 * height_.col(kReach) - height_.col(kReach + k);
    height_.col(top + k) = 2.0 * height_.col(top) - height_.col(top - k);
  }
}

/// Counted from the first sample on the lens, so that it may be negative.
int MadeSurface::first_sample(double at, int axis) const {
  return std::clamp(static_cast<int>(at / step_[axis]), 0, cells_[axis] - 1) - kReach;
}

SurfacePoint MadeSurface::at(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2i first(first_sample(xy.x(), 0), first_sample(xy.y(), 1));
  const Eigen::Vector2d offset = first.cast<double>().cwiseProduct(step_) - xy;
  const Weights x(offset.x(), step_.x(), sigma_.x());
  const Weights y(offset.y(), step_.y(), sigma_.y());
  SurfacePoint made;
  for (std::size_t n = 0; n < Weights::kCount; ++n) {
    const double* const z =
        &height_(first.x() + kReach, first.y() + kReach + static_cast<Eigen::Index>(n));
    double value = 0.0;
    double slope = 0.0;
    for (std::size_t m = 0; m < Weights::kCount; ++m) {
      value += x.value[m] * z[m];
      slope += x.slope[m] * z[m];
    }
    made.z += y.value[n] * value;
    made.slope += Eigen::Vector2d(y.value[n] * slope, y.slope[n] * value);
  }
  for (int k = 0; k < 2; ++k) {
    const double low = made_.rim_depth * std::exp(-xy[k] / made_.rim_length);
    const double high = made_.rim_depth * std::exp((xy[k] - size_[k]) / made_.rim_length);
    made.z -= low + high;
    made.slope[k] += (low - high) / made_.rim_length;
  }
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
