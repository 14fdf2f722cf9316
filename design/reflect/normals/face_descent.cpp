// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/normals/face_descent.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lensforge::reflect {
namespace {

/// A normal turns by at most this much in a step, rad: two lobe widths.
constexpr double kLongestStep = 0.15;
constexpr double kGrowth = 2.0;
constexpr double kShrinkage = 0.25;

/// Turns that are tried to leave a plateau, rad: in steps of a lobe's width up to beyond the band.
constexpr std::array kTilts{0.15, 0.3, 0.45};

/// The normal turned away from the horizon.
Eigen::Vector3d tilted(const Eigen::Vector3d& n, double angle) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() - n.z() * n;
  if (up.norm() < std::sin(angle)) return n;
  return (n + std::copysign(std::tan(angle), n.z()) * up.normalized()).normalized();
}

/// Normals with what they give.
struct State {
  Eigen::Matrix3Xd normal;
  Eigen::Matrix3Xd gradient;
  Eigen::VectorXd by_face;
};

State state_at(const NormalObjective& objective, Eigen::Matrix3Xd normal) {
  State state{std::move(normal), {}, {}};
  state.by_face = objective.by_face(state.normal, state.gradient);
  return state;
}

/// Takes over the faces whose share is lower.
void keep_lower(const State& next, State& best) {
  for (Eigen::Index k = 0; k < best.normal.cols(); ++k) {
    if (next.by_face[k] >= best.by_face[k]) continue;
    best.normal.col(k) = next.normal.col(k);
    best.by_face[k] = next.by_face[k];
  }
}

/// The normal with which a face mirrors light d to the sensor.
Eigen::Vector3d mirror(const LightPaths& paths, Eigen::Index face, Eigen::Index d) {
  const Eigen::Vector3d half = paths.sensor(face, d) + paths.light(d);
  return half.norm() > 0.0 ? Eigen::Vector3d(half.normalized()) : paths.sensor(face, d);
}

}  // namespace

Eigen::Matrix3Xd descended_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int steps, const Executor& executor) {
  State best = state_at(objective, start);
  Eigen::VectorXd curvature = objective.curvature(start);
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(start.cols());
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix3Xd trial(3, start.cols());
    const auto advance = [&](std::int64_t k) {
      const Eigen::Vector3d move = -(factor[k] / curvature[k]) * best.gradient.col(k);
      const double shortening = std::min(1.0, kLongestStep / std::max(move.norm(), 1e-300));
      trial.col(k) = (best.normal.col(k) + shortening * move).normalized();
    };
    parallel_for(executor, "face steps", start.cols(), advance);
    const State next = state_at(objective, std::move(trial));
    for (Eigen::Index k = 0; k < start.cols(); ++k) {
      const bool lower = next.by_face[k] <= best.by_face[k];
      factor[k] *= lower ? kGrowth : kShrinkage;
      if (!lower) continue;
      best.normal.col(k) = next.normal.col(k);
      best.gradient.col(k) = next.gradient.col(k);
      best.by_face[k] = next.by_face[k];
    }
    curvature = objective.curvature(best.normal);
  }
  return best.normal;
}

Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start) {
  State best = state_at(objective, start);
  Eigen::Matrix3Xd trial(3, start.cols());
  if (goal.maximizes()) {
    for (Eigen::Index d = 0; d < paths.directions().count(); ++d) {
      for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = mirror(paths, k, d);
      keep_lower(state_at(objective, trial), best);
    }
    return best.normal;
  }
  for (const double angle : kTilts) {
    for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = tilted(start.col(k), angle);
    keep_lower(state_at(objective, trial), best);
  }
  return best.normal;
}

}  // namespace lensforge::reflect
