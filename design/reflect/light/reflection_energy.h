// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/light/light_lanes.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {

/// Path of light that reaches a face by way of another one.
struct PathHit {
  Eigen::Vector3f w;  ///< From the face towards the other one.
  std::int32_t face;  ///< The other one.
};

/// Number of directions per half sphere along which light from other faces is gathered: on a
/// right-angled dihedral their mean differs from the closed form by less than 0.1 %.
inline constexpr int kGatherDirections = 128;

/// Everything that depends on the faces' positions and not on how their normals are turned: which
/// face is lit and seen in which direction, and which other faces it sees. Cached, so that energies
/// and gradients of one shape have no noise.
///
/// Visibility is checked at one point of the face per direction; the points of all directions cover
/// the face evenly (the R2 sequence, Roberts 2018).
class LightPaths {
 public:
  static constexpr std::uint8_t kLit = 1;
  static constexpr std::uint8_t kSeen = 2;

  /// @param gather  directions per half sphere for light by way of another face; 0: direct only.
  /// @throw Interrupted
  LightPaths(const SurfaceMesh& mesh, const Goal& goal, DirectionSet directions, int gather,
             const Executor& executor);

  [[nodiscard]] const Faces& faces() const { return faces_; }
  [[nodiscard]] const DirectionSet& directions() const { return directions_; }
  [[nodiscard]] Eigen::Vector3d light(Eigen::Index d) const { return directions_.light.col(d); }
  [[nodiscard]] bool has_place() const { return to_place_.cols() > 0; }
  /// Direction from the face towards the sensor.
  [[nodiscard]] Eigen::Vector3d sensor(Eigen::Index face, Eigen::Index d) const {
    return has_place() ? Eigen::Vector3d(to_place_.col(face)) : light(d);
  }
  /// Directions towards the light, padded().
  [[nodiscard]] const LaneVectors<double>& light_lanes() const { return light_lanes_; }
  /// One byte per direction of a face, padded(): kLit and kSeen.
  [[nodiscard]] const std::uint8_t* flags(Eigen::Index face) const {
    return flags_.data() + slot(face, 0);
  }
  [[nodiscard]] bool lit(Eigen::Index face, Eigen::Index d) const {
    return (flags_[slot(face, d)] & kLit) != 0;
  }
  [[nodiscard]] bool seen(Eigen::Index face, Eigen::Index d) const {
    return (flags_[slot(face, d)] & kSeen) != 0;
  }
  [[nodiscard]] std::span<const PathHit> hits(Eigen::Index face) const {
    const auto begin = static_cast<std::size_t>(face * gather_);
    return {hits_.data() + begin,
            static_cast<std::size_t>(hit_count_[static_cast<std::size_t>(face)])};
  }
  /// Solid angle of a hit, sr.
  [[nodiscard]] double hit_angle() const {
    return gather_ > 0 ? 2.0 * std::numbers::pi / gather_ : 0.0;
  }

 private:
  [[nodiscard]] std::size_t slot(Eigen::Index face, Eigen::Index d) const {
    return static_cast<std::size_t>(face * light_lanes_.rows() + d);
  }
  class Caster;

  Faces faces_;
  DirectionSet directions_;
  LaneVectors<double> light_lanes_;
  Eigen::Matrix3Xd to_place_;  ///< Set if the goal has a place.
  std::vector<std::uint8_t> flags_;
  int gather_;
  std::vector<PathHit> hits_;  ///< `gather_` slots per face.
  std::vector<std::int32_t> hit_count_;
};

/// Energies are reported as kEnergyScale·½ Σ a_k ⟨loss(L) V⟩ with a_k = A_k/ΣA: the energy of the
/// paper's Eq. 8 for a surface of area 5, about that of its models, whose diagonal is 3.
inline constexpr double kEnergyScale = 5.0;

/// Radiance below which light by way of another face is kept constant; the gradients of a torus and
/// of a trihedral then differ by less than 1 % from those of all hits.
inline constexpr double kRadianceFloor = 0.02;

/// The loss of a goal: the energy itself, with its sign. 1/(L + ε), averaged over many directions
/// of the light, favours a little light from all of them, as a matt surface gives, over much light.
[[nodiscard]] inline Loss loss_for(const Goal& goal) {
  return goal.maximizes() ? Loss::kNegativeSquare : Loss::kSquare;
}

/// Radiance of one face towards the sensor for every direction, by one reflection and by two; the
/// latter only if the sensor sees the face.
struct FaceRadiance {
  Eigen::VectorXd direct;
  Eigen::VectorXd indirect;
};

/// Contributions of the faces to the energy.
struct FaceTerms {
  Eigen::VectorXd value;
  Eigen::Matrix3Xd gradient;  ///< Of the energy by free vectors in place of the normals.
  /// Gauss–Newton estimate of the curvature by each face's normal: the mean over its three
  /// components of Σ_d weight·loss″(L) (∂L/∂n)², of the direct light.
  Eigen::VectorXd curvature;
};

/// The reflectivity energy (Tojo et al., Eqs. 5–8) over cached paths, as a smooth function of the
/// faces' normals: E = 5·½ Σ_k a_k Σ_d weight_d loss(L_kd) V_kd with L_kd = F(n_k; w_o, w_l) +
/// Σ_hits F(n_k; w_o, w_i) F(n_q; −w_i, w_l) Δω. Areas, visibility and hits stay as cached. Same
/// bits for any number of threads.
///
/// Hits that cannot matter while normals turn by less than a lobe's width keep their light under
/// the faces' own normals.
class ReflectionEnergy {
 public:
  /// @param paths  must outlive it.
  /// @param floor  radiance below which a hit is kept constant, judged with lobes of a third of the
  ///               exponent; 0: all hits follow the normals.
  ReflectionEnergy(const LightPaths& paths, Loss loss, const Executor& executor,
                   double floor = kRadianceFloor);

  /// @param normals  3 × F. @throw Interrupted
  [[nodiscard]] double value(const Eigen::Matrix3Xd& normals) const;

  /// The value, and its derivative by free vectors in place of the unit normals, 3 × F.
  [[nodiscard]] double value_and_gradient(const Eigen::Matrix3Xd& normals,
                                          Eigen::Matrix3Xd& gradient) const;

  [[nodiscard]] FaceTerms terms(const Eigen::Matrix3Xd& normals) const;

  /// Contribution of every face to the value.
  [[nodiscard]] Eigen::VectorXd by_face(const Eigen::Matrix3Xd& normals) const;

  /// The value without light by way of other faces.
  [[nodiscard]] double direct_value(const Eigen::Matrix3Xd& normals) const;

  [[nodiscard]] FaceRadiance radiance(Eigen::Index face, const Eigen::Matrix3Xd& normals) const;

 private:
  class FaceLight;
  class HitSelection;

  /// A hit that follows the normals.
  struct MovingHit {
    std::uint32_t direction;
    std::uint16_t hit;  ///< Index among the face's hits.
  };

  [[nodiscard]] double scale(Eigen::Index face) const { return 0.5 * kEnergyScale * share_[face]; }
  /// Light of a face's hits that do not follow the normals, padded().
  [[nodiscard]] const float* resting(Eigen::Index face) const {
    return resting_.data() + face * paths_.light_lanes().rows();
  }

  const LightPaths& paths_;
  Loss loss_;
  Executor executor_;
  Eigen::VectorXd share_;         ///< a_k
  Eigen::VectorXd weight_lanes_;  ///< Weights of the directions, padded().
  Eigen::VectorXd one_lanes_;
  std::vector<std::vector<MovingHit>> moving_;  ///< Per face.
  std::vector<float> resting_;
};

/// Meshes with fewer faces than this are evaluated on a finer mesh of the same surface, so that
/// shadows need not follow faces.
inline constexpr std::int64_t kEvaluatedFaces = 4096;

/// Energies of the square of the radiance, with the normals of the mesh's own faces.
/// @throw Interrupted
Energies evaluate(const SurfaceMesh& mesh, const Goal& goal, const DirectionSet& directions,
                  const Executor& executor);

/// Samples of the published algorithm (Tojo et al., 4.6).
inline constexpr int kPaperDirections = 16;  ///< N_dir per face.
inline constexpr int kPaperPaths = 8;        ///< N_path per direction.

/// Monte-Carlo estimate of the reflectivity energy's gradient by the faces' normals (Tojo et al.,
/// 4.2): random directions of the light, random points on the face, paths of one and two
/// reflections sampled by the lobe (Lafortune & Willems 1994), and unbiased radiative
/// back-propagation with newly drawn paths (Nimier-David et al. 2020). All numbers follow from seed
/// and face: the same bits for any number of threads.
class PathEstimator {
 public:
  /// @param mesh, field  must outlive it.
  PathEstimator(const SurfaceMesh& mesh, const LightField& field, Loss loss,
                const Executor& executor);

  /// Unbiased estimate of ReflectionEnergy::value_and_gradient() for infinitely many directions, 3
  /// × F; biased only for the inverse loss, whose slope is taken at an estimated radiance.
  /// @param normals  3 × F, unit. @throw Interrupted
  [[nodiscard]] Eigen::Matrix3Xd gradient(const Eigen::Matrix3Xd& normals,
                                          std::uint64_t seed) const;

 private:
  class Walker;

  const SurfaceMesh& mesh_;
  const LightField& field_;
  Loss loss_;
  Executor executor_;
  Faces faces_;
  Eigen::VectorXd share_;
  RayScene scene_;
};

}  // namespace lensforge::reflect
