// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// What polishing does to a surface; all lengths in mm.
struct PolishModel {
  double sigma = 0.0;  ///< Of the Gaussian that heights are averaged with, ≥ 0; 0: not polished.
  double rim_depth = 0.0;   ///< Taken off in addition at the rim, ≥ 0.
  double rim_length = 1.0;  ///< Distance over which that falls to 1/e of itself, > 0.

  friend bool operator==(const PolishModel&, const PolishModel&) = default;
};

}  // namespace lensforge
