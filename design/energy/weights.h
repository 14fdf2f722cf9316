// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Weights of the objective (Sun et al., Eqs. 17, 18 and 20). All ≥ 0; values of their Appendix E
/// but for two.
/// - λ2, for which the paper has 1e3: E_grad weighs the finest detail of the picture's error up to
///   81 times as much as its large shapes, and the optimiser then leaves those, and the faces that
///   a crease has left in black. 128², MAE after 300 iterations with 1e3, 10 and 0: logo 0.0145,
///   0.0058 and 0.0031, portrait 0.0084, 0.0071 and 0.0072. Even E_grad itself ends lower on the
///   logo without it (23, 16, 14).
/// - λ4, for which it has 20: what E_edge weighs hangs on ν, whose scale the paper leaves open, and
///   with the ν of plan_levels() its share of the total soon exceeds the picture's. Facets, MAE in
///   thousandths after six rounds with 2e-2, 2e-3 and 2e-4: 128² portrait 3.3, 3.2 and 3.1; 96²
///   logo 0.50, 0.36 and 0.42; 64² relief with 2.5 vertices per pixel side 0.060, 0.015 and 0.006.
///   Smooth, 128² portrait with 2e-2 and 2e-3: by the normals 1.7 and 1.0, as a surface 2.8
///   and 2.2.
/// Lengths enter the terms in working-picture pixels, the paper's unit of length.
struct ObjectiveWeights {
  double image = 1e2;       ///< λ1, E_img
  double gradient = 0.0;    ///< λ2, E_grad
  double boundary = 1e-3;   ///< λ3, E_bdr
  double smooth = 2e-3;     ///< λ4, E_smooth = E_face + τ1 E_edge + τ2 E_lap
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
