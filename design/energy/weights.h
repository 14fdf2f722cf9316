// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Weights of the objective (Sun et al., Eqs. 17, 18 and 20). All ≥ 0; values of their Appendix E
/// but for λ4, for which the paper has 20: what E_edge weighs hangs on ν, whose scale the paper
/// leaves open. With the ν of plan_levels(), 20 outweighs the picture (128² portrait: MAE 0.0079
/// facet, 0.0121 smooth); 2 gives 0.0057 and 0.0106, 0.2 gives 0.0054 and 0.0099.
/// Lengths enter the terms in working-picture pixels, the paper's unit of length.
struct ObjectiveWeights {
  double image = 1e2;       ///< λ1, E_img
  double gradient = 1e3;    ///< λ2, E_grad
  double boundary = 1e-3;   ///< λ3, E_bdr
  double smooth = 2e-1;     ///< λ4, E_smooth = E_face + τ1 E_edge + τ2 E_lap
  double barrier = 1e-8;    ///< λ5, E_barr
  double edge = 3e0;        ///< τ1, E_edge
  double laplacian = 2e-1;  ///< τ2, E_lap
  double align = 1e0;       ///< γ1, E_align; Eq. 20 has no picture terms but this and the next
  double flux = 1e1;        ///< γ2, E_flux
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
  double align = 0.0;
  double flux = 0.0;
  double total = 0.0;
};

}  // namespace lensforge
