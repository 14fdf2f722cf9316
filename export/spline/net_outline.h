// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/optics/outline.h"
#include "export/spline/spline_net.h"

namespace lensforge {

/// A quarter of a circle seen along z, counter-clockwise; mm, rad.
struct WallArc {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius = 0.0;
  double start = 0.0;  ///< Angle from +x.
};

/// One smooth part of a lens's edge, seen along z: a straight line or a quarter of a circle.
struct OutlineWall {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< mm
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  std::optional<WallArc> arc;

  /// Parameter of the end: mm along a line, rad along an arc. It is 0 at the start.
  [[nodiscard]] double last() const;
  [[nodiscard]] Eigen::Vector2d at(double t) const;
  /// Derivative of at().
  [[nodiscard]] Eigen::Vector2d along(double t) const;
  /// mm
  [[nodiscard]] double length() const;
};

/// Returns the nominal edge of a lens, counter-clockwise, with true arcs instead of chords. Polygon
/// corners closer than kShortestWall to the previous one are omitted.
std::vector<OutlineWall> walls_of(const Outline& outline);

/// Shortest wall, mm: far above the tolerance of a solid's edges, far below the precision of a
/// mill.
inline constexpr double kShortestWall = 1e-3;

/// Volume between a net of one patch and the face below it inside of the net's outline, mm³:
/// Gauss's rule in the knot cells inside; small triangles, clipped at the outline, in those that it
/// crosses; arcs are exact. Relative error below 1e-7 (OutlineVolume.IsTheIntegral).
/// @pre net.outline; one patch.
double outlined_volume(const SplineNet& net);

}  // namespace lensforge
