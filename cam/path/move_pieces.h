// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

#include "cam/path/move.h"

namespace lensforge {

/// A short part of a move.
struct MovePiece {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double lowest;  ///< No point of the part is below this, mm.
  double reach;   ///< No point of it is farther than this from its middle, seen from above, mm.

  [[nodiscard]] Eigen::Vector2d middle() const { return 0.5 * (from + to).head<2>(); }
};

/// Cuts a straight move or an arc that begins at `begin` into parts of at most `length` mm along it
/// and hands them to `take` in order; one part at least.
void split_move(const Eigen::Vector3d& begin, const PathMove& move, double length,
                const std::function<void(const MovePiece&)>& take);

}  // namespace lensforge
