// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "design/reflect/light/reflection_energy.h"

namespace lensforge::reflect {

/// Holds target normals near those of the reference mesh: β/2 Σ A_k ‖t_k − n_k⁰‖² with
/// A_k = kEnergyScale·a_k (Tojo et al., 4.6).
struct NormalAnchor {
  Eigen::Matrix3Xd reference;  ///< n⁰, 3 × F.
  double strength = 0.1;       ///< β
};

/// Reflectivity energy and anchor as a function of free vectors x_k in place of the unit normals
/// t_k = x_k/|x_k|.
class NormalObjective {
 public:
  /// All must outlive it.
  NormalObjective(const ReflectionEnergy& energy, const NormalAnchor& anchor,
                  const Eigen::VectorXd& area_share)
      : energy_(energy), anchor_(anchor), share_(area_share) {}

  /// @param gradient  by x, 3 × F.
  double operator()(const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& gradient) const;

  /// What every face adds to the value at unit normals; the gradient; an estimate of every face's
  /// curvature, > 0.
  [[nodiscard]] FaceTerms by_face(const Eigen::Matrix3Xd& normals) const;

  /// What every face adds to the value at unit normals.
  [[nodiscard]] Eigen::VectorXd values(const Eigen::Matrix3Xd& normals) const;

 private:
  [[nodiscard]] double weight(Eigen::Index face) const {
    return anchor_.strength * kEnergyScale * share_[face];
  }

  const ReflectionEnergy& energy_;
  const NormalAnchor& anchor_;
  const Eigen::VectorXd& share_;
};

/// Lowers the objective by L-BFGS with a line search; its initial matrix is diagonal, the inverse
/// of every face's curvature.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd optimized_normals(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int iterations, const Executor& executor);

}  // namespace lensforge::reflect
