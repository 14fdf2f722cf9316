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

/// Holds target normals near those of the reference mesh: β/2 Σ A_k ‖t_k − n_k⁰‖² with A_k =
/// kEnergyScale·a_k (Tojo et al., 4.6).
struct NormalAnchor {
  Eigen::Matrix3Xd reference;  ///< n⁰, 3 × F.
  double strength = 0.1;       ///< β
};

/// Reflectivity energy and anchor as a function of free vectors x_k in place of the unit normals
/// t_k = x_k/|x_k|.
class NormalObjective {
 public:
  /// All arguments must outlive it.
  NormalObjective(const ReflectionEnergy& energy, const NormalAnchor& anchor,
                  const Eigen::VectorXd& area_share)
      : energy_(energy), anchor_(anchor), share_(area_share) {}

  /// @param gradient  by x, 3 × F.
  double operator()(const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& gradient) const;

  /// Contribution of every face to the value at unit normals; the gradient; an estimate of every
  /// face's curvature, > 0.
  [[nodiscard]] FaceTerms by_face(const Eigen::Matrix3Xd& normals) const;

  /// Contribution of every face to the value at unit normals.
  [[nodiscard]] Eigen::VectorXd values(const Eigen::Matrix3Xd& normals) const;

 private:
  [[nodiscard]] double weight(Eigen::Index face) const {
    return anchor_.strength * kEnergyScale * share_[face];
  }

  const ReflectionEnergy& energy_;
  const NormalAnchor& anchor_;
  const Eigen::VectorXd& share_;
};

/// Lowers the objective by L-BFGS with a line search. Its initial matrix is diagonal, the inverse
/// of every face's curvature.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd optimized_normals(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int iterations, const Executor& executor);

/// Lowers the objective face by face. Apart from light by way of other faces the normals do not
/// depend on each other, so each has a step length of its own: the gradient over its Gauss–Newton
/// curvature, doubled after a step that lowered the face's share of the objective. A step that did
/// not is undone, and the length divided by four.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd descended_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int steps, const Executor& executor);

/// Turns faces across plateaus of the objective, wherever that lowers their share of it. A face
/// that looks straight into the band reflects the same light until it has turned by some 12°: it is
/// tilted up or down, away from the horizon. A face that should light a place is turned so that it
/// mirrors one of the lights there; from more than a lobe's width away descent would not find it.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start);

/// The published update of target normals (Tojo et al., Algorithm 1): `steps` gradient steps of
/// fixed length with estimated gradients. Eq. 9 prints half of the energy's derivative, so a step
/// with η = 200 on a surface of area 5 is t ← t − η (½ ∂E/∂t + 5 β a (t − n⁰)). It is taken per
/// unit of area and scaled to a mesh of kPaperFaces, so that it does not depend on the mesh's
/// resolution.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd stepped_normals(const PathEstimator& estimator, const NormalAnchor& anchor,
                                 const Eigen::VectorXd& area_share, const Eigen::Matrix3Xd& start,
                                 int steps, std::uint64_t seed);

/// Number of faces of the model that the paper's step is scaled for (Fig. 14).
inline constexpr double kPaperFaces = 5914.0;

/// Turns that target normals asked for and faces did not make, summed over updates of the vertices:
/// the scaled multiplier of the method of multipliers (Boyd et al. 2011, 3.1.1) with the step
/// kUnmetStep. A face that its neighbours hold back is asked for more until it turns.
class UnmetTurns {
 public:
  /// @param sum  turns missing so far, 3 × F: zeros, or an earlier sum().
  explicit UnmetTurns(Eigen::Matrix3Xd sum) : sum_(std::move(sum)) {}

  [[nodiscard]] const Eigen::Matrix3Xd& sum() const { return sum_; }

  /// Returns the targets with the sum added, of unit length. @param targets  3 × F.
  [[nodiscard]] Eigen::Matrix3Xd added_to(const Eigen::Matrix3Xd& targets) const;

  /// @param targets  without the sum.
  /// @param reached  the faces' normals after the update.
  void record(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& reached);

 private:
  Eigen::Matrix3Xd sum_;
};

/// Share of the missing turn that the next update adds. An ellipsoid of 400 faces ended at 5.3e-5
/// with 0.2, 1.0e-3 with 1 and 3.6e-3 without (β = 0.01, 60 updates).
inline constexpr double kUnmetStep = 0.2;
/// Maximum sum of a face, 27°, so that a face that cannot turn does not distort its neighbours.
inline constexpr double kLargestUnmetTurn = 0.5;

/// Filters face normals by total variation (Zhang et al. 2015, "Variational mesh denoising using
/// total variation and piecewise constant function space"): minimises Σ_e w_e l_e ‖N_1 − N_2‖ + α
/// Σ_k A_k ‖N_k − N_k^in‖² with w_e = exp(−‖N_1 − N_2‖⁴), by ADMM with penalty 5 and 40 iterations.
/// Creases stay sharp; noise between them is removed.
///
/// Lengths and areas are those of the mesh it is made for; they hardly change while it deforms.
class TvDenoiser {
 public:
  /// @param fidelity  α > 0, 1/length in the units of the mesh; the larger, the smaller the
  ///                  changes.
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
