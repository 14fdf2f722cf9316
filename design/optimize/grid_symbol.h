// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// The part of a preconditioner that acts on one coordinate: a function of the grid Laplacian's
/// eigenvalue λ (1/cell², cells of the mesh's columns), all ≥ 0.
struct GridSymbol {
  double scale = 1.0;   ///< s
  double floor = 0.0;   ///< μ
  double power = 2.0;   ///< p
  double growth = 0.0;  ///< γ: the symbol is s / ((μ + λ)^p (1 + γλ)).
};

}  // namespace lensforge
