// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// Waves that an axis of the machine leaves in the surface, around one wavelength: its height is
/// off by a function of that axis's place alone, the same in every row.
struct WavinessBand {
  double wavelength = 10.0;  ///< mm, > 0; waves of 0.7 to 1.4 of it are drawn.
  double rms_um = 0.1;       ///< Root mean square of the height, µm, ≥ 0.

  friend bool operator==(const WavinessBand&, const WavinessBand&) = default;
};

/// How far machine, tool, polish and light may be off what the programs assume. Measured quantities
/// are normal with the stated standard deviation (σ), limits of what a maker or a person keeps are
/// uniform up to the stated bound. Where the defaults come from: docs/fabrication.md, "How sure is
/// the forecast".
struct Tolerances {
  /// Of the machine's X and Y axes each.
  std::vector<WavinessBand> waviness{{30.0, 0.3}, {3.0, 0.03}};
  double row_um = 0.02;      ///< Height of one row against the next, σ, µm, ≥ 0.
  double row_length = 10.0;  ///< Along a row over which that changes, mm, > 0.
  double backlash_um = 1.0;  ///< Of the axis along the rows, 0 to this, µm, ≥ 0.
  double radius_um = 5.0;    ///< Radius of the ball, ± this, µm, ≥ 0.
  double runout_um = 5.0;    ///< Total indicated run-out of the ball, 0 to this, µm, ≥ 0.

  double polish_sigma = 0.1;  ///< Of the polish's σ from part to part, as a share: σ, 0 … 0.3.
  double polish_within = 0.05;  ///< The same from place to place on a part, 0 … 0.3.

  double index = 0.001;   ///< Refractive index, ± this, ≥ 0.
  double distance = 1.0;  ///< Of the screen, ± this, mm, ≥ 0.
  double tilt_deg = 0.2;  ///< Of the part about its x and y axes, σ each, degrees, ≥ 0.
  /// Full angle of the source as the lens sees it, 0 to this, mrad, ≥ 0; the design assumes 0.
  double source_mrad = 0.5;
  double temperature_k = 5.0;     ///< Of the part, ± this, K, ≥ 0.
  double expansion_per_k = 7e-5;  ///< Of the material's lengths.
  double index_per_k = -1.05e-4;  ///< Of the material's refractive index.

  friend bool operator==(const Tolerances&, const Tolerances&) = default;
};

}  // namespace lensforge
