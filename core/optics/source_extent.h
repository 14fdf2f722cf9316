// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// Distribution of an extended source's light: rows of pixels from the top, seen from the lens with
/// the lens's y up. Empty: an evenly lit disc.
struct SourceShape {
  int columns = 0;
  int rows = 0;
  std::vector<double> weights;  ///< ≥ 0, not all 0.

  [[nodiscard]] bool is_disc() const { return weights.empty(); }

  friend bool operator==(const SourceShape&, const SourceShape&) = default;
};

/// Maximum number of pixels on a shape's longer side: each is a separate beam in an exact
/// rendering.
inline constexpr int kMaxShapeSide = 16;

/// Size of a source. A point, or parallel light of one direction, has width 0.
struct SourceExtent {
  double width =
      0.0;  ///< Diameter of a disc or width of a shape: rad for parallel light, mm for a point.
  SourceShape shape;

  [[nodiscard]] bool none() const { return width == 0.0; }

  friend bool operator==(const SourceExtent&, const SourceExtent&) = default;
};

}  // namespace lensforge
