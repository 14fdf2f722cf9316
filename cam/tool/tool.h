// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// The lower end of a cutter.
enum class CutterShape {
  kBall,  ///< A half sphere.
  kBull,  ///< Flat with a rounded corner.
  kFlat,
};

/// A cylinder around the axis: shank, collet, holder. Heights count from the tip.
struct ToolSection {
  double diameter = 0.0;  ///< mm
  double from = 0.0;      ///< mm above the tip
  double to = 0.0;        ///< mm above the tip

  friend bool operator==(const ToolSection&, const ToolSection&) = default;
};

/// A milling cutter, how it is clamped and how it is run.
struct Tool {
  int number = 1;  ///< T word, ≥ 1.
  std::string name;
  CutterShape shape = CutterShape::kBall;
  double diameter = 0.4;       ///< mm, > 0.
  double corner_radius = 0.0;  ///< Of a bull-nose cutter, mm, in 0 … diameter / 2.
  int teeth = 2;
  double flute_length = 1.0;  ///< What cuts, mm above the tip; above it nothing may touch material.
  std::vector<ToolSection> sections;  ///< Above the flutes, from below.
  double spindle_rpm = 23000.0;
  double feed = 500.0;    ///< mm/min
  double plunge = 150.0;  ///< Feed straight down, mm/min.

  [[nodiscard]] double radius() const { return 0.5 * diameter; }
  friend bool operator==(const Tool&, const Tool&) = default;
};

}  // namespace lensforge
