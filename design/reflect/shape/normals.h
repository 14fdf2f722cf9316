// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
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

/// Lowers the objective face by face. But for light by way of other faces its normals do not depend
/// on each other, so that each takes a step of its own length: the gradient over its Gauss–Newton
/// curvature, doubled after a step that lowered the face's share of the objective and a quarter
/// after one that did not, which is taken back.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd descended_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int steps, const Executor& executor);

/// Turns faces to where no slope leads, wherever that lowers their share of the objective. A face
/// that looks straight into the band sends back the same light until it has turned by some 12°: it
/// is tilted up or down, whichever way it looks already. A face that is to light a place is turned
/// so that it mirrors one of the lights there; beyond a lobe's width it would not find it.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start);

/// The published update of target normals (Tojo et al., Algorithm 1): `steps` gradient steps of
/// fixed length with estimated gradients. Eq. 9 prints half of the energy's derivative, so that a
/// step with η = 200 on a surface of area 5 is t ← t − η (½ ∂E/∂t + 5 β a (t − n⁰)); it is taken
/// per unit of area, scaled to a mesh of kPaperFaces, so that it does not depend on the mesh's
/// resolution.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd stepped_normals(const PathEstimator& estimator, const NormalAnchor& anchor,
                                 const Eigen::VectorXd& area_share, const Eigen::Matrix3Xd& start,
                                 int steps, std::uint64_t seed);

/// Faces of the model that the paper's step is scaled for (Fig. 14).
inline constexpr double kPaperFaces = 5914.0;

/// What target normals asked of faces and did not get, summed over updates of the vertices: the
/// scaled multiplier of the method of multipliers (Boyd et al. 2011, 3.1.1) with the step
/// kUnmetStep. A face next to others that hold it back is asked for more until it turns.
class UnmetTurns {
 public:
  /// @param sum  what was missing before, 3 × F: zeros, or what sum() returned.
  explicit UnmetTurns(Eigen::Matrix3Xd sum) : sum_(std::move(sum)) {}

  [[nodiscard]] const Eigen::Matrix3Xd& sum() const { return sum_; }

  /// Targets with the sum added, of unit length. @param targets  3 × F.
  [[nodiscard]] Eigen::Matrix3Xd added_to(const Eigen::Matrix3Xd& targets) const;

  /// @param targets  before the sum was added.
  /// @param reached  the faces' normals after the update.
  void record(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& reached);

 private:
  Eigen::Matrix3Xd sum_;
};

/// Share of what is missing that the next update asks for on top. An ellipsoid of 400 faces ended
/// at 5.3e-5 with 0.2, 1.0e-3 with 1 and 3.6e-3 without, moved by 2.5, 1.2 and 0.6 % (β = 0.01, 60
/// updates, one sum for both stages).
inline constexpr double kUnmetStep = 0.2;
/// Longest sum of a face, so that what cannot turn at all does not tear at its neighbours: 27°.
inline constexpr double kLargestUnmetTurn = 0.5;

/// Filters face normals by total variation (Zhang et al. 2015, "Variational mesh denoising using
/// total variation and piecewise constant function space"): minimises
/// Σ_e w_e l_e ‖N_1 − N_2‖ + α Σ_k A_k ‖N_k − N_k^in‖² with w_e = exp(−‖N_1 − N_2‖⁴), by ADMM with
/// penalty 5 and 40 iterations. Creases stay sharp, noise between them goes.
///
/// Lengths and areas are those of the mesh it is made for: they hardly change while it deforms.
class TvDenoiser {
 public:
  /// @param fidelity  α, 1/length in the units of the mesh; the larger, the less changes. > 0
  TvDenoiser(const SurfaceMesh& mesh, double fidelity);
  ~TvDenoiser();
  TvDenoiser(TvDenoiser&&) noexcept;
  TvDenoiser& operator=(TvDenoiser&&) noexcept;

  /// @param normals  3 × F, unit. @return unit normals.
  [[nodiscard]] Eigen::Matrix3Xd denoise(const Eigen::Matrix3Xd& normals) const;

  /// The objective at `normals` with the weights w_e taken from `weights_from`.
  [[nodiscard]] double objective(const Eigen::Matrix3Xd& normals, const Eigen::Matrix3Xd& input,
                                 const Eigen::Matrix3Xd& weights_from) const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace lensforge::reflect
