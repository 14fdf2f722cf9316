// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "cam/tool/tool.h"

namespace lensforge {

/// Lower silhouette of one part of a tool, turned about its axis: a flat disc with a rounded edge.
/// A ball is all edge, a flat cutter, a shank and a holder are all disc.
struct CutterProfile {
  double radius = 0.0;  ///< Of the part, mm, ≥ 0.
  double corner = 0.0;  ///< Radius of the rounded edge, mm, in 0 … radius.
  double base = 0.0;    ///< Of the part's lowest point above the tool's tip, mm.

  /// Radius of the flat disc, mm.
  [[nodiscard]] double flat() const { return radius - corner; }

  /// Height of the silhouette above the tool's tip at distance d ≥ 0 from the axis, mm; infinite
  /// beyond the radius. Convex and nowhere falling, which is what the drop relies on.
  [[nodiscard]] double height(double d) const {
    if (d > radius) return std::numeric_limits<double>::infinity();
    const double out = d - flat();
    if (out <= 0.0) return base;
    return base + corner - std::sqrt(std::fmax(0.0, (corner - out) * (corner + out)));
  }

  friend bool operator==(const CutterProfile&, const CutterProfile&) = default;
};

/// What cuts: the lower end of a tool.
CutterProfile cutting_profile(const Tool& tool);

/// What may touch nothing: the tool above its flutes, at the cutter's own diameter, and its
/// sections as cylinders. Material beside a section that is no wider than the cutter was cut away
/// before, so such a section is left out.
std::vector<CutterProfile> shank_profiles(const Tool& tool);

/// cutting_profile() and shank_profiles() together.
std::vector<CutterProfile> whole_profile(const Tool& tool);

/// Distance from the axis that the tool fills somewhere below `height` above its tip, mm.
double widest_below(const Tool& tool, double height);

/// The profile with a skin of `allowance` (mm, ≥ 0) all around: where it touches a surface, the
/// tool is that far from it, measured along the surface's normal.
CutterProfile grown(const CutterProfile& profile, double allowance);

/// The profile swept over a disc of radius `reach` (mm, ≥ 0) around its axis.
CutterProfile widened(const CutterProfile& profile, double reach);

}  // namespace lensforge
