// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>

namespace lensforge {

/// What a motion of the tool is for.
enum class MoveKind : std::uint8_t {
  kRapid,   ///< In air, as fast as the axes go.
  kPlunge,  ///< Down into material at the plunge feed, or a ramp or helix at it.
  kLink,    ///< At feed, in air or over finished surface.
  kCut,     ///< At the cutting feed.
};

/// One motion of the tool's tip from where it is to `end`: mm, lens frame (not the program's).
struct PathMove {
  MoveKind kind = MoveKind::kCut;
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  /// Arcs lie in a plane x = const (G19), y = const (G18) or z = const (G17, a helix where z
  /// changes): the number of the axis that the plane is normal to, or -1 for a straight move.
  int arc_axis = -1;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Of the arc.
  bool clockwise = false;  ///< G2: seen from the positive end of the normal axis.
  double feed = 0.0;       ///< mm/min; 0 for rapids.
};

/// Takes the moves of an operation in order, many at a time; the span is valid during the call.
using MoveSink = std::function<void(std::span<const PathMove>)>;

}  // namespace lensforge
