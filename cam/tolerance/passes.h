// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// The finishing rows as they lie on the lens.
struct Passes {
  double pitch = 0.06;       ///< Between rows, mm, > 0; rows lie on the rim.
  double ball_radius = 0.2;  ///< mm, > pitch / 2.
  int axis = 0;              ///< Along which they run: 0 for x, 1 for y.
  bool zigzag = true;        ///< To and fro.
  bool cross = false;        ///< A second raster along the other axis.
  bool cast = false;         ///< In a mould: what is cut deeper stands higher on the lens.
};

}  // namespace lensforge
