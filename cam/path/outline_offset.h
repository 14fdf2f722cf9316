// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lensforge {

/// Closed way of a tool's axis around a part.
struct OutlineWay {
  std::vector<Eigen::Vector2d> points;  ///< Counter-clockwise, mm.
  /// Area beside the part that the tool cannot reach, in notches narrower than it, mm².
  double left = 0.0;
};

/// How far the axis stays outside of its exact way, mm: the tool never cuts into the part, which is
/// larger by this at most on straight sides and around its corners.
inline constexpr double kOutlineOversize = 0.005;

/// The way on which a tool of this radius touches a polygon from outside.
/// @param polygon  counter-clockwise, not self-crossing, mm.
OutlineWay offset_outline(const std::vector<Eigen::Vector2d>& polygon, double radius);

}  // namespace lensforge
