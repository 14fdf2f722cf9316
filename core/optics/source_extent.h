// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// How the light of an extended source is spread over it: rows of pixels from the top, as the
/// source is seen from the lens with the lens's y up. Empty: an evenly lit disc.
struct SourceShape {
  int columns = 0;
  int rows = 0;
  std::vector<double> weights;  ///< ≥ 0, not all 0.

  [[nodiscard]] bool is_disc() const { return weights.empty(); }

  friend bool operator==(const SourceShape&, const SourceShape&) = default;
};

/// Most pixels on a shape's longer side: each is a beam of its own in an exact rendering.
inline constexpr int kMaxShapeSide = 16;

/// How large a source is. One that is a point, or infinitely far away in one direction, has width
/// 0.
struct SourceExtent {
  double width = 0.0;  ///< Disc's diameter or shape's width: of parallel light rad, of a point mm.
  SourceShape shape;

  [[nodiscard]] bool none() const { return width == 0.0; }

  friend bool operator==(const SourceExtent&, const SourceExtent&) = default;
};

}  // namespace lensforge
