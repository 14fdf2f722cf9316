// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

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
