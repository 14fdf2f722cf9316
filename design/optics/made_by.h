// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// How the part is cut and polished that a design is to be right for; lengths in mm. A ball-end
/// mill's rows, then an average with a Gaussian, as PolishedField has it.
struct MadeBy {
  double pitch = 0.06;         ///< Between neighbouring rows, > 0.
  bool rows_along_x = true;    ///< Else along y.
  double polish_sigma = 0.03;  ///< Of the Gaussian, > 0.
  double rim_depth = 0.0;      ///< Taken off in addition at the rim, ≥ 0.
  double rim_length = 1.0;     ///< Distance over which that falls to 1/e of itself, > 0.

  /// The same of a part that is cast in a mould which is cut so, and polished then: the mould is
  /// 1 / (1 − shrinkage) as large.
  [[nodiscard]] MadeBy cast(double shrinkage) const {
    MadeBy made = *this;
    made.pitch *= 1.0 - shrinkage;
    return made;
  }

  friend bool operator==(const MadeBy&, const MadeBy&) = default;
};

}  // namespace lensforge
