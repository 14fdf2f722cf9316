// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Weights of the objective (Sun et al., Eqs. 17 and 18; values of their Appendix E). All ≥ 0.
/// Lengths enter the terms in working-picture pixels, the paper's unit of length.
struct ObjectiveWeights {
  double image = 1e2;       ///< λ1, E_img
  double gradient = 1e3;    ///< λ2, E_grad
  double boundary = 1e-3;   ///< λ3, E_bdr
  double smooth = 2e1;      ///< λ4, E_smooth = E_face + τ1 E_edge + τ2 E_lap
  double barrier = 1e-8;    ///< λ5, E_barr
  double edge = 3e0;        ///< τ1, E_edge
  double laplacian = 2e-1;  ///< τ2, E_lap
};

/// Values of the terms before weighting, and the weighted total.
struct EnergyValues {
  double image = 0.0;
  double gradient = 0.0;
  double boundary = 0.0;
  double barrier = 0.0;
  double face = 0.0;
  double edge = 0.0;
  double laplacian = 0.0;
  double total = 0.0;
};

}  // namespace lensforge
