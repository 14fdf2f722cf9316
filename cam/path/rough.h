// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Common inputs of the operations before finishing. All references must outlive them.
struct RoughSite {
  const ProfileCutter& surface;  ///< A height field over its box's rectangle.
  const Workshop& workshop;      ///< Validated.
  StockMap& stock;               ///< Current stock; the operation takes its cut from it.
};

/// Result of an operation before finishing.
struct RoughResult {
  /// Its certificate: gouge 0 into the surface with the allowance over the whole of every move;
  /// excess over the drop curve with the allowance at all sampled points; chords between them add
  /// at most a tenth of their spacing.
  OperationSummary summary;
  Extreme deepest_cut;  ///< Material above the cutter's silhouette, mm, from StockMap::cut().
  Extreme most_left;    ///< Material left on the surface, mm, from most_left().
};

/// The blank of a workshop around a surface, in cells of 0.1 mm, or larger ones on blanks above 200
/// mm.
StockMap whole_blank(const Workshop& workshop, const Eigen::AlignedBox3d& surface);

/// Distance beyond a surface's rectangle to which cut_rough() and cut_semi() remove material in a
/// blank that is wider than that by more than a tool's radius, mm. @param top  of the blank, mm.
double rough_reach(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top);

/// Cuts the blank down to the surface plus the allowance, level by level. Passes on a level run at
/// its height where the surface is below it, and follow the surface near where the level above
/// ended. The depth of cut is the stepdown plus only what passes leave between them on slopes.
/// Beyond the lens it clears the room that later tools, with their shanks, need.
///
/// The tool enters material along its pass, to and fro, no steeper than the ramp angle against the
/// pass, or down a helix where one fits (EntryStyle), never straight down. Between neighbouring
/// passes it stays down; elsewhere it takes the quicker of a link at feed just above all remaining
/// material and a rapid at the safe height. It goes around clamps; a warning states what stays
/// uncut under them.
/// @throw Interrupted if `control` asks for an end; `sink` has then received part of a cut.
RoughResult cut_rough(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                      const RunControl& control);

/// One raster on the surface plus its allowance; enters and links as cut_rough() does.
RoughResult cut_semi(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                     const RunControl& control);

}  // namespace lensforge
