// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace lensforge {

/// Plane of an arc: G17, G18, G19.
enum class ArcPlane { kXY, kZX, kYZ };

/// A circular arc, or a helix, from a start point; mm and radians.
struct Arc {
  int first = 0;   ///< Axis from which the angle counts.
  int second = 1;  ///< Axis at a right angle to it, counter-clockwise.
  int third = 2;   ///< Axis that the plane is normal to.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< At the height of the start point.
  double radius = 0.0;
  double begin = 0.0;  ///< Angle of the start point.
  double sweep = 0.0;  ///< Counter-clockwise positive; ±2π for a full circle.
  double rise = 0.0;   ///< Along `third` over the whole sweep.

  /// Length of the path.
  [[nodiscard]] double length() const;
  /// The point after the share `part` in 0 … 1 of the sweep.
  [[nodiscard]] Eigen::Vector3d at(double part) const;
  /// The box around all of it.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
};

/// What an arc word says of its shape, mm.
struct ArcRequest {
  ArcPlane plane = ArcPlane::kXY;
  bool clockwise = false;                            ///< G2, seen from the third axis's tip.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< I J K: from the start to the centre.
  std::optional<double> radius;                      ///< R; negative for more than half a turn.
};

/// An arc, or why there is none.
struct ArcResult {
  Arc arc;
  std::string reason;  ///< Empty for an arc.
};

/// The arc from `start` to `end`. Equal points in the plane are a full circle with I J K. With
/// I J K the two radii may differ by 0.005 mm, or by 0.5 mm and a thousandth of the radius,
/// whichever rule is kinder: Grbl's own rule.
ArcResult make_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                   const ArcRequest& request);

}  // namespace lensforge
