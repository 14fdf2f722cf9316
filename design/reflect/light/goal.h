// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/compute/host_device.h"

namespace lensforge::reflect {

/// What the reflected light is to do (Tojo et al., 4.1 and Fig. 12).
enum class GoalKind {
  kStealth,  ///< As little as possible goes back to where the light comes from.
  kPoint,    ///< As much as possible goes to a point.
  kLine,     ///< As much as possible goes to the nearest point of a line.
  kDeflect,  ///< As little as possible goes to a point.
};

/// ε of the loss 1/(L + ε).
inline constexpr double kLossFloor = 1e-5;

/// A goal with its place, in the units of the mesh.
struct Goal {
  GoalKind kind = GoalKind::kStealth;
  Eigen::Vector3d from{0.0, 0.0, 0.0};  ///< The point, or an end of the line.
  Eigen::Vector3d to{0.0, 0.0, 0.0};    ///< The line's other end.

  /// Whether the sensor stands in one place, rather than where the light comes from.
  [[nodiscard]] bool has_place() const { return kind != GoalKind::kStealth; }
  [[nodiscard]] bool maximizes() const {
    return kind == GoalKind::kPoint || kind == GoalKind::kLine;
  }

  /// Where light that leaves `p` is to go to or not to go to: on a line q1 + s·d it is
  /// s = clamp((p − q1)·d/|d|², 0, 1). @pre has_place()
  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector3d& p) const {
    if (kind != GoalKind::kLine) return from;
    const Eigen::Vector3d d = to - from;
    return from + std::clamp((p - from).dot(d) / d.squaredNorm(), 0.0, 1.0) * d;
  }
};

/// What is minimised for a radiance L.
enum class Loss {
  kSquare,          ///< L²
  kNegativeSquare,  ///< −L², where L is to be large.
  kInverse,         ///< 1/(L + ε), where L is to be large (Tojo et al., 4.1).
};

[[nodiscard]] LF_HD inline double loss_of(Loss loss, double radiance) {
  if (loss == Loss::kInverse) return 1.0 / (radiance + kLossFloor);
  return loss == Loss::kSquare ? radiance * radiance : -radiance * radiance;
}

/// Derivative of loss_of().
[[nodiscard]] LF_HD inline double loss_slope(Loss loss, double radiance) {
  if (loss != Loss::kInverse) return loss == Loss::kSquare ? 2.0 * radiance : -2.0 * radiance;
  const double inverse = 1.0 / (radiance + kLossFloor);
  return -inverse * inverse;
}

/// Size of the second derivative of loss_of().
[[nodiscard]] LF_HD inline double loss_curvature(Loss loss, double radiance) {
  if (loss != Loss::kInverse) return 2.0;
  const double inverse = 1.0 / (radiance + kLossFloor);
  return 2.0 * inverse * inverse * inverse;
}

/// The energy itself, with its sign. 1/(L + ε), averaged over many directions of the light, asks
/// for a little light from all of them, which a matt surface gives, and not for much light.
[[nodiscard]] inline Loss loss_for(const Goal& goal) {
  return goal.maximizes() ? Loss::kNegativeSquare : Loss::kSquare;
}

}  // namespace lensforge::reflect
