// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/tool.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Closed path of a tool's axis around a part.
struct OutlineWay {
  std::vector<Eigen::Vector2d> points;  ///< Counter-clockwise, mm.
  /// Area beside the part that the tool cannot reach, in notches narrower than it, mm².
  double left = 0.0;
};

/// Offset of the axis outwards from its exact path, mm: the tool never cuts into the part, which is
/// at most this much larger on straight sides and around its corners.
inline constexpr double kOutlineOversize = 0.005;

/// The path on which a tool of this radius touches a polygon from outside.
/// @param polygon  counter-clockwise, not self-crossing, mm.
OutlineWay offset_outline(const std::vector<Eigen::Vector2d>& polygon, double radius);

/// Tabs that hold the part in its frame until it is snapped out.
struct TabOptions {
  int count = 4;        ///< ≥ 0
  double width = 3.0;   ///< Along the outline, at its narrowest, mm, > 0.
  double height = 0.8;  ///< Above the underside, mm, > 0.
};

/// Options for cutting a part out of its blank.
struct OutlineCut {
  Tool tool;
  TabOptions tabs;
  double stepdown = 1.0;        ///< Maximum per turn, mm, > 0.
  double ramp_angle_deg = 3.0;  ///< Steepest way into material.
  double safe_z = 5.0;          ///< Of rapid moves, mm, lens frame.
  double bottom = 0.0;          ///< Lowest tip, mm, lens frame: not below the blank's underside.
  double clearance = 0.5;       ///< Above material before the tool is fed, mm.
};

/// Minimum width of the frame behind a tab, mm.
inline constexpr double kTabFrame = 2.0;

/// The same cut with fewer tabs, at least one, if the tool could not ramp down between them.
OutlineCut with_tabs_that_fit(const std::vector<Eigen::Vector2d>& outline, OutlineCut cut);

/// @throw InputError naming option, value and rule where a tool, or tabs, do not fit this part in
///        this blank: tabs too close for the tool to get down between them, or without a frame
///        outside of the slot.
void require_outline_cut(const std::vector<Eigen::Vector2d>& outline, const OutlineCut& cut,
                         const Eigen::AlignedBox3d& blank);

/// Cuts around the part in a helix from above the material down to the bottom, then once more each
/// way along it. At a tab the tool is lifted straight up and comes down behind it along the ramp;
/// the turn in the other direction removes what the ramp left. Tabs are evenly spaced, starting
/// where their frame is widest.
/// @param outline  of the part, counter-clockwise, mm.
/// @param stock    current stock; the operation takes its cut from it.
/// @pre require_outline_cut() passed. @throw Interrupted.
OperationSummary cut_outline(const std::vector<Eigen::Vector2d>& outline, const OutlineCut& cut,
                             StockMap& stock, const MoveSink& sink, const RunControl& control);

}  // namespace lensforge
