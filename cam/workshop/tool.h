// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace lensforge {

/// Shape of a cutter's lower end.
enum class CutterShape {
  kBall,  ///< A half sphere.
  kBull,  ///< Flat with a rounded corner.
  kFlat,
};

/// A cylinder around the axis: shank, collet, holder. Heights are measured from the tip.
struct ToolSection {
  double diameter = 0.0;  ///< mm
  double from = 0.0;      ///< mm above the tip
  double to = 0.0;        ///< mm above the tip

  friend bool operator==(const ToolSection&, const ToolSection&) = default;
};

/// A milling cutter, its clamping and its cutting data.
struct Tool {
  int number = 1;  ///< T word, ≥ 1.
  std::string name;
  CutterShape shape = CutterShape::kBall;
  double diameter = 0.4;       ///< mm, > 0.
  double corner_radius = 0.0;  ///< Of a bull-nose cutter, mm, in 0 … diameter / 2.
  int teeth = 2;
  double flute_length = 1.0;  ///< Cutting length from the tip, mm; nothing above it may touch
                              ///< material.
  std::vector<ToolSection> sections;  ///< Above the flutes, from below.
  double spindle_rpm = 23000.0;
  double feed = 500.0;    ///< mm/min
  double plunge = 150.0;  ///< Feed straight down, mm/min.

  [[nodiscard]] double radius() const { return 0.5 * diameter; }
  friend bool operator==(const Tool&, const Tool&) = default;
};

/// The tool scaled to another diameter, mm, > 0: flutes and neck scale with it, shank and holder do
/// not.
Tool resized(Tool tool, double diameter);

/// Lower silhouette of one part of a tool, turned about its axis: a flat disc with a rounded edge.
/// A ball is all edge, a flat cutter, a shank and a holder are all disc.
struct CutterProfile {
  double radius = 0.0;  ///< Of the part, mm, ≥ 0.
  double corner = 0.0;  ///< Radius of the rounded edge, mm, in 0 … radius.
  double base = 0.0;    ///< Height of the part's lowest point above the tool's tip, mm.

  /// Radius of the flat disc, mm.
  [[nodiscard]] double flat() const { return radius - corner; }

  /// Height of the silhouette above the tool's tip at distance d ≥ 0 from the axis, mm; infinite
  /// beyond the radius. Convex and nowhere falling; the drop-cutter relies on that.
  [[nodiscard]] double height(double d) const {
    if (d > radius) return std::numeric_limits<double>::infinity();
    const double out = d - flat();
    if (out <= 0.0) return base;
    return base + corner - std::sqrt(std::fmax(0.0, (corner - out) * (corner + out)));
  }

  friend bool operator==(const CutterProfile&, const CutterProfile&) = default;
};

/// Profile of the cutting part: the lower end of a tool.
CutterProfile cutting_profile(const Tool& tool);

/// Profiles of the parts that must not touch anything: the tool above its flutes, at the cutter's
/// own diameter, and its sections as cylinders. Sections no wider than the cutter are left out: the
/// cutter has already removed the material beside them.
std::vector<CutterProfile> shank_profiles(const Tool& tool);

/// cutting_profile() and shank_profiles() together.
std::vector<CutterProfile> whole_profile(const Tool& tool);

/// Radius of the widest part of the tool below `height` above its tip, mm.
double widest_below(const Tool& tool, double height);

/// The profile offset by `allowance` (mm, ≥ 0) all around: where it touches a surface, the tool's
/// distance from it along the surface's normal is the allowance.
CutterProfile grown(const CutterProfile& profile, double allowance);

/// The profile swept over a disc of radius `reach` (mm, ≥ 0) around its axis.
CutterProfile widened(const CutterProfile& profile, double reach);

/// Diameters of ball-end mills in makers' catalogues below a given one, largest first, mm: tenths
/// from 0.6 mm down to 0.1 mm, catalogue steps above.
/// @param count  maximum number returned.
std::vector<double> smaller_balls(double diameter, std::size_t count);

}  // namespace lensforge
