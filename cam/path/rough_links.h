// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "cam/path/rough_moves.h"
#include "cam/path/rough_passes.h"
#include "cam/path/tip_floor.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// What links need to know of an operation. All references must outlive them.
struct LinkSite {
  const Workshop& workshop;
  const Tool& tool;
  const TipFloor& floor;
  StockMap& stock;
  double safe_z = 0.0;  ///< Of rapid moves, mm.
  double ramp_angle_deg = 3.0;
  double helix_radius = 0.0;  ///< Of the axis' circle when entering, mm; 0 for ramps.
  double spacing = 0.1;       ///< Of points at which floor and stock are asked for, mm.
};

/// Nothing of blank and clamps is higher than this, mm.
double highest_obstacle(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Height of rapid moves in a workshop: Process::safe_height above blank and clamps, mm.
double safe_height_of(const Workshop& workshop, const Eigen::AlignedBox3d& blank);

/// Ways from one pass to the next.
class RoughLinks {
 public:
  RoughLinks(const LinkSite& site, RoughMoves& moves);

  /// To the beginning of `path` and into the material there, if there is any, no steeper against
  /// path and floor than the ramp angle: down a helix through that beginning, counter-clockwise,
  /// which a tool that turns clockwise cuts in climb, where one of four circles is nowhere steep;
  /// else along the path, to and fro. Ends at the beginning of the path.
  void enter(const TipPath& path);

  /// Straight to `end` at feed, no lower than `level` and the floor, which may cut.
  /// @return false, and does nothing, if the floor on the way is above the blank, if a clamp lifts
  ///         it, or if the end is so far below the way that the tool would have to plunge to it.
  bool cross(const Eigen::Vector3d& end, double level);

  /// Up to the safe height.
  void retract();

 private:
  [[nodiscard]] std::optional<double> clear_height(const Eigen::Vector3d& to);
  [[nodiscard]] double air_above(const Eigen::Vector2d& p);
  void travel(const Eigen::Vector3d& to);
  bool helix(const TipPath& path);
  void lift_to_floor(TipPath& circle) const;
  void wind_down(const TipPath& circle);
  void ramp(const TipPath& path, double lift);

  LinkSite site_;
  RoughMoves& moves_;
  std::vector<CutterProfile> parts_;
};

}  // namespace lensforge
