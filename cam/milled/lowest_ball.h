// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "cam/contact/drop_cutter.h"

namespace lensforge {

/// The ball that reaches deepest over a place, cutting into nothing.
struct LowestBall {
  double z = 0.0;                                    ///< Its lower side over the place, mm.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mm
  double spread = 0.0;  ///< Largest distance between the points that hold it, mm; 0 with one.
};

/// A height and slopes of a surface over a place.
struct TangentPlane {
  double z = 0.0;  ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

/// Moves a ball over a place of a surface until it reaches deepest.
///
/// Sought is the centre c that makes c.z − √(R² − |q − c.xy|²) least while the ball cuts into no
/// triangle. Triangles are taken up one by one as the drop-cutter finds them cut. Each is replaced
/// by a plane that keeps the ball off it; over planes the lowest ball is known in closed form (on
/// one, in the valley of two, in the pit of three), and there the planes are laid anew: the
/// convex–concave procedure (Yuille and Rangarajan 2003). Over facets that meet in valleys one
/// round is exact. From the ball that is tangent at q it leads to a minimum next to it.
class LowestBallSearch {
 public:
  /// A ball rests where it cuts no deeper than this, mm.
  static constexpr double kResting = 1e-10;

  /// @param cutter  of the surface; must outlive the search.
  /// @param margin  how deep a ball may cut into the mesh and still count as resting, mm: what the
  ///                mesh may be off the surface that tangent planes are given of.
  explicit LowestBallSearch(const DropCutter& cutter, double margin = 0.0)
      : cutter_(cutter), resting_(kResting + margin) {}

  /// @param near  a location close by, which makes it faster; is set to the last one.
  [[nodiscard]] LowestBall over(const Eigen::Vector2d& q, const TangentPlane& plane,
                                CutterLocation& near) const;

 private:
  const DropCutter& cutter_;
  double resting_;
};

/// The point of a triangle that is nearest to p.
Eigen::Vector3d nearest_point(const Eigen::Matrix3d& corners, const Eigen::Vector3d& p);

}  // namespace lensforge
