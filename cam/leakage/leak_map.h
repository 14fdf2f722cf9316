// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"

namespace lensforge {

/// A height that differs, and where.
struct HeightDifference {
  double value = 0.0;  ///< mm, part − designed: above 0 where material is left.
  Eigen::Vector2d place{0.0, 0.0};
};

/// Where on the lens light leaves that lands in chosen pixels and would not by design.
struct LeakMap {
  std::int64_t columns = 0;     ///< Cells along x.
  std::int64_t rows = 0;        ///< Cells along y, from the least.
  CellCounts grid_cells{1, 1};  ///< Cells of the rendered grid in a map cell, which is square.
  /// Share of the lens's flux, signed: a cell that took light away from those pixels is below 0.
  std::vector<double> leakage;
  std::vector<HeightDifference> height;  ///< Largest by size in every cell.

  [[nodiscard]] double total() const;
};

/// Traces the light of both surfaces cell by cell: a cell's leakage is Σ weight · (flux of the
/// part's cell − flux of the designed cell) over all pixels, exact as the pictures are. With
/// pixels_with_surplus() as weights the map sums to Σ max(0, g − g_designed), and a cell that is
/// left as designed counts nothing, wherever its light lands. Same bits for any number of threads.
/// Of a spectrum all light counts as of its middle colour.
/// @param weights  one per pixel, row by row from the top.
/// @param cell  wished side of a map cell, mm, > 0.
/// @throw Interrupted as the executor does.
LeakMap map_leakage(const NamedSurface& designed, const NamedSurface& part,
                    const FieldRenderSetup& setup, std::span<const double> weights, double cell,
                    const Executor& executor);

/// Which places to pick from a map.
struct LeakPlaceOptions {
  int span = 5;   ///< A place is a square of span × span cells, ≥ 1.
  int count = 3;  ///< Places at most, ≥ 0.
};

/// What would leak from a place if one thing were changed.
struct LeakTrial {
  std::string change;      ///< "a 0.3 mm ball"
  double leakage = 0.0;    ///< As LeakPlace::leakage, with all else as it is.
  double dark_flux = 0.0;  ///< As LeakPlace::dark_flux.
  double moves = 1.0;      ///< Of the whole lens's finishing, as a multiple of those without it.
  double minutes = 1.0;    ///< Likewise, at the finishing feed.
};

/// A part of the lens from which light leaks.
struct LeakPlace {
  CellRange cells;                  ///< Of the rendered grid.
  Eigen::Vector2d place{0.0, 0.0};  ///< Where most of it leaves, mm on the lens.
  double side = 0.0;                ///< Of the square, mm.
  double leakage = 0.0;    ///< Share of the lens's flux that leaves here and lands where the design
                           ///< puts less, less what would by design.
  double dark_flux = 0.0;  ///< Of the lens's flux, into dark pixels, likewise.
  HeightDifference height;          ///< Largest difference of height in the worst cell.
  Eigen::Vector2d lands{0.0, 0.0};  ///< Centre of that light, pixel coordinates.
  std::vector<CausePart> parts;     ///< `leakage` and `dark_flux` by cause; dark_ratio stays 0.
  std::vector<LeakTrial> trials;    ///< Of remedies, if any were tried.
};

/// The places that leak most, worst first, a square's side or more apart. `map` gives the places,
/// the chain the causes. @throw Interrupted as the executor does.
std::vector<LeakPlace> worst_places(const LeakMap& map, const LeakageChain& chain,
                                    const LeakageResult& result, const FieldRenderSetup& setup,
                                    const LeakPlaceOptions& options, const Executor& executor);

}  // namespace lensforge
