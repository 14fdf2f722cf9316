// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "design/reflect/light/light_paths.h"

namespace lensforge::reflect {

/// Energies are stated as kEnergyScale·½ Σ a_k ⟨loss(L) V⟩ with a_k = A_k/ΣA: the energy of the
/// paper's Eq. 8 for a surface of area 5, about that of its models, whose diagonal is 3.
inline constexpr double kEnergyScale = 5.0;

/// Radiance below which light by way of another face is kept as it is: with it the gradients of a
/// torus and of a trihedral differ by less than 1 % from those of all hits.
inline constexpr double kRadianceFloor = 0.02;

/// Radiance of one face towards the sensor for every direction, by one reflection and by two; the
/// latter only where the sensor sees the face.
struct FaceRadiance {
  Eigen::VectorXd direct;
  Eigen::VectorXd indirect;
};

/// What faces add to the energy.
struct FaceTerms {
  Eigen::VectorXd value;
  Eigen::Matrix3Xd gradient;  ///< Of the whole energy by free vectors in place of the normals.
  /// Gauss–Newton estimate of the curvature by each face's normal: the mean over its three
  /// components of Σ_d weight·loss″(L) (∂L/∂n)², of the direct light.
  Eigen::VectorXd curvature;
};

/// The reflectivity energy (Tojo et al., Eqs. 5–8) over cached paths, as a smooth function of the
/// faces' normals: E = 5·½ Σ_k a_k Σ_d weight_d loss(L_kd) V_kd with
/// L_kd = F(n_k; w_o, w_l) + Σ_hits F(n_k; w_o, w_i) F(n_q; −w_i, w_l) Δω. Areas, visibility and
/// hits stay as they were cached. Same bits for any number of threads.
///
/// Hits that cannot come to matter while normals turn by less than a lobe's width keep the light
/// that they have with the faces' own normals.
class ReflectionEnergy {
 public:
  /// @param paths  must outlive it.
  /// @param floor  radiance below which a hit is kept as it is, judged with lobes of a third of the
  ///               exponent; 0: all hits follow the normals.
  ReflectionEnergy(const LightPaths& paths, Loss loss, const Executor& executor,
                   double floor = kRadianceFloor);

  /// @param normals  3 × F. @throw Interrupted
  [[nodiscard]] double value(const Eigen::Matrix3Xd& normals) const;

  /// The value, and its derivative by free vectors in place of the unit normals, 3 × F.
  [[nodiscard]] double value_and_gradient(const Eigen::Matrix3Xd& normals,
                                          Eigen::Matrix3Xd& gradient) const;

  [[nodiscard]] FaceTerms terms(const Eigen::Matrix3Xd& normals) const;

  /// What every face adds to the value.
  [[nodiscard]] Eigen::VectorXd by_face(const Eigen::Matrix3Xd& normals) const;

  /// Without light by way of other faces.
  [[nodiscard]] double direct_value(const Eigen::Matrix3Xd& normals) const;

  [[nodiscard]] FaceRadiance radiance(Eigen::Index face, const Eigen::Matrix3Xd& normals) const;

 private:
  class FaceLight;
  class HitSelection;

  /// A hit that follows the normals.
  struct MovingHit {
    std::uint32_t direction;
    std::uint16_t hit;  ///< Its number among the face's hits.
  };

  [[nodiscard]] double scale(Eigen::Index face) const { return 0.5 * kEnergyScale * share_[face]; }
  /// Light of the hits of a face that do not follow the normals, padded().
  [[nodiscard]] const float* resting(Eigen::Index face) const {
    return resting_.data() + face * paths_.light_lanes().rows();
  }

  const LightPaths& paths_;
  Loss loss_;
  Executor executor_;
  Eigen::VectorXd share_;         ///< a_k
  Eigen::VectorXd weight_lanes_;  ///< Of the directions, padded().
  Eigen::VectorXd one_lanes_;
  std::vector<std::vector<MovingHit>> moving_;  ///< Of every face.
  std::vector<float> resting_;
};

}  // namespace lensforge::reflect
