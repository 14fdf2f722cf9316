// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// What the operations before finishing share. All references must outlive them.
struct RoughSite {
  const ProfileCutter& surface;  ///< A height field over its box's rectangle.
  const Workshop& workshop;      ///< Validated.
  StockMap& stock;               ///< As it was left so far; the operation takes its cut from it.
};

/// What an operation before finishing came to.
struct RoughResult {
  /// Its certificate: gouge 0 into the surface with the allowance over the whole of every move;
  /// excess over the drop curve with the allowance at all points where the surface was asked for,
  /// before chords (at most a tenth of their spacing more).
  OperationSummary summary;
  Extreme deepest_cut;  ///< Material above the cutter's silhouette, mm, as StockMap::cut() sees it.
  Extreme most_left;    ///< Material left on the surface, mm, as most_left() sees it.
};

/// The blank of a workshop around a surface, in cells of 0.1 mm, or larger ones on a blank of more
/// than 200 mm.
StockMap whole_blank(const Workshop& workshop, const Eigen::AlignedBox3d& surface);

/// How far beyond a surface's rectangle cut_rough() and cut_semi() take material away in a blank
/// that is wider than that by a tool's radius more, mm. @param top  of the blank, mm.
double rough_reach(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top);

/// Cuts the blank down to the surface plus the allowance, level by level: on each level passes that
/// run at its height where the surface is below it and follow the surface where it is not, next to
/// where the level above ended. The cut is as deep as the stepdown, and more only by what passes
/// leave between them on slopes. Beyond the lens it clears what later tools, with their shanks, run
/// through.
///
/// Into material the tool goes along its pass, to and fro, no steeper than the ramp angle against
/// the pass, or down a helix where one fits (EntryStyle), never straight down. Between neighbouring
/// passes it stays down; elsewhere it takes the quicker of a way at feed just above all material
/// that may be left and a rapid one at the safe height. Clamps are walked around: what is under
/// them stays uncut, and a warning says so.
/// @throw Interrupted if `control` asks for an end; what went to `sink` before is part of a cut.
RoughResult cut_rough(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                      const RunControl& control);

/// One raster on the surface plus its allowance; enters and links as cut_rough() does.
RoughResult cut_semi(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                     const RunControl& control);

}  // namespace lensforge
