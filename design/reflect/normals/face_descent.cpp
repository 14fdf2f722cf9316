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

/// Normals with what every face adds to the objective.
struct Candidate {
  Eigen::Matrix3Xd normal;
  Eigen::VectorXd value;
};

/// Takes over the faces whose share is lower.
void keep_lower(const NormalObjective& objective, const Eigen::Matrix3Xd& normal, Candidate& best) {
  const Eigen::VectorXd value = objective.values(normal);
  for (Eigen::Index k = 0; k < normal.cols(); ++k) {
    if (value[k] >= best.value[k]) continue;
    best.normal.col(k) = normal.col(k);
    best.value[k] = value[k];
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
  Eigen::Matrix3Xd normal = start;
  FaceTerms best = objective.by_face(start);
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(start.cols());
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix3Xd trial(3, start.cols());
    const auto advance = [&](std::int64_t k) {
      const Eigen::Vector3d move = -(factor[k] / best.curvature[k]) * best.gradient.col(k);
      const double shortening = std::min(1.0, kLongestStep / std::max(move.norm(), 1e-300));
      trial.col(k) = (normal.col(k) + shortening * move).normalized();
    };
    parallel_for(executor, "face steps", start.cols(), advance);
    const FaceTerms next = objective.by_face(trial);
    for (Eigen::Index k = 0; k < start.cols(); ++k) {
      const bool lower = next.value[k] <= best.value[k];
      factor[k] *= lower ? kGrowth : kShrinkage;
      if (!lower) continue;
      normal.col(k) = trial.col(k);
      best.value[k] = next.value[k];
      best.gradient.col(k) = next.gradient.col(k);
      best.curvature[k] = next.curvature[k];
    }
  }
  return normal;
}

Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start) {
  Candidate best{start, objective.values(start)};
  Eigen::Matrix3Xd trial(3, start.cols());
  if (goal.maximizes()) {
    for (Eigen::Index d = 0; d < paths.directions().count(); ++d) {
      for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = mirror(paths, k, d);
      keep_lower(objective, trial, best);
    }
    return best.normal;
  }
  for (const double angle : kTilts) {
    for (Eigen::Index k = 0; k < start.cols(); ++k) trial.col(k) = tilted(start.col(k), angle);
    keep_lower(objective, trial, best);
  }
  return best.normal;
}

}  // namespace lensforge::reflect
