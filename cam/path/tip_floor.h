// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// Minimum height of a tool's tip: on the surface plus an allowance, with shank and holder clear of
/// it as well, and the whole tool clear of the clamps.
///
/// Beyond hold() outside the surface's rim the tip keeps the height that it has there, where its
/// rounded edge has dropped by 0.3 of the edge's radius: enough to clear the rim of surfaces that
/// fall towards it without cutting more beside the part.
class TipFloor {
 public:
  /// Contacts that hold the tip up near a place, to start the next search from: one per part of the
  /// tool.
  using Trace = std::vector<CutterLocation>;

  /// @param surface  must outlive this. @param keep_outs  must outlive this.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           std::span<const KeepOut> keep_outs, double clearance);
  /// Without clamps. @param rim  of this part, where the surface holds several.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           const Eigen::AlignedBox2d& rim);

  /// Maximum of the tip's minimum height over all places within `reach` of p, mm: a move of length
  /// 2·reach around p that stays above it cuts into nothing.
  [[nodiscard]] double over(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  /// The same without the clamps, and with nothing but the clamps.
  [[nodiscard]] double over_surface(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  [[nodiscard]] double over_clamps(const Eigen::Vector2d& p, double reach) const;
  [[nodiscard]] bool has_clamps() const { return !keep_outs_.empty(); }

  /// A lower bound of over(p, 0, …), found faster: from the contacts near p.
  [[nodiscard]] double at_least(const Eigen::Vector2d& p, const Trace& trace) const;

  /// Distance beyond the rim at which the tip starts to keep its height, mm.
  [[nodiscard]] double hold() const { return hold_; }
  static double hold_of(const Tool& tool, double allowance);

 private:
  [[nodiscard]] Eigen::Vector2d held(const Eigen::Vector2d& p) const;

  const ProfileCutter& surface_;
  Eigen::AlignedBox2d rim_;
  std::span<const KeepOut> keep_outs_;
  double clearance_;
  std::vector<CutterProfile> parts_;  ///< Of the tool with its allowance.
  std::vector<CutterProfile> whole_;  ///< Of the tool with its clearance from clamps.
  double hold_;
};

}  // namespace lensforge
