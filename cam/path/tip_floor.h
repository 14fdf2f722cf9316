// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// How low a tool's tip may go: on the surface plus an allowance, with its shank and holder clear
/// of it as well, and the whole tool clear of the clamps.
///
/// Beyond the surface's rim the tip keeps the height that it has hold() away from it, where its
/// rounded edge has dropped by 0.3 of the edge's radius: enough to clear the rim of surfaces that
/// fall towards it, and no more material cut beside the part than that.
class TipFloor {
 public:
  /// What keeps the tip up near a place, to begin the next search with: one per part of the tool.
  using Trace = std::vector<CutterLocation>;

  /// @param surface  must outlive this. @param keep_outs  likewise.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           std::span<const KeepOut> keep_outs, double clearance);
  /// Without clamps. @param rim  of the part at hand, where the surface holds several.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           const Eigen::AlignedBox2d& rim);

  /// Largest of the lowest heights of the tip over all places that are no farther than `reach` from
  /// p: a move of a length of 2·reach around p that stays above it cuts into nothing. mm.
  [[nodiscard]] double over(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  /// The same where there are no clamps, and where there is nothing but clamps.
  [[nodiscard]] double over_surface(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  [[nodiscard]] double over_clamps(const Eigen::Vector2d& p, double reach) const;
  [[nodiscard]] bool has_clamps() const { return !keep_outs_.empty(); }

  /// A height that over(p, 0, …) is nowhere below, found sooner: on what kept the tip up near p.
  [[nodiscard]] double at_least(const Eigen::Vector2d& p, const Trace& trace) const;

  /// Distance beyond the rim from which the tip keeps its height, mm.
  [[nodiscard]] double hold() const { return hold_; }
  static double hold_of(const Tool& tool, double allowance);

 private:
  [[nodiscard]] Eigen::Vector2d held(const Eigen::Vector2d& p) const;

  const ProfileCutter& surface_;
  Eigen::AlignedBox2d rim_;
  std::span<const KeepOut> keep_outs_;
  double clearance_;
  std::vector<CutterProfile> parts_;  ///< Of the tool with its skin.
  std::vector<CutterProfile> whole_;  ///< Of the tool with its distance to clamps.
  double hold_;
};

}  // namespace lensforge
