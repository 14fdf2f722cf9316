// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"

namespace lensforge {

/// A difference of heights and its place.
struct HeightDifference {
  double value = 0.0;  ///< mm, part − designed: above 0 where material is left.
  Eigen::Vector2d place{0.0, 0.0};
};

/// Places on the lens whose light lands in chosen pixels, contrary to the design.
struct LeakMap {
  std::int64_t columns = 0;     ///< Cells along x.
  std::int64_t rows = 0;        ///< Cells along y, from the least.
  CellCounts grid_cells{1, 1};  ///< Cells of the rendered grid in a (square) map cell.
  /// Share of the lens's flux, signed: negative for a cell that takes light away from those pixels.
  std::vector<double> leakage;
  std::vector<HeightDifference> height;  ///< Largest by absolute value in every cell.

  [[nodiscard]] double total() const;
};

/// Traces the light of both surfaces cell by cell: a cell's leakage is Σ weight · (flux of the
/// part's cell − flux of the designed cell) over all pixels, exact as the pictures are. With
/// pixels_with_surplus() as weights the map sums to Σ max(0, g − g_designed), and a cell left as
/// designed counts 0, wherever its light lands. All light of a spectrum is traced in its middle
/// colour. Same bits for any number of threads.
/// @param weights  one per pixel, row by row from the top.
/// @param cell  requested side of a map cell, mm, > 0.
/// @throw Interrupted as the executor does.
LeakMap map_leakage(const NamedSurface& designed, const NamedSurface& part,
                    const FieldRenderSetup& setup, std::span<const double> weights, double cell,
                    const Executor& executor);

/// Selection of places from a map.
struct LeakPlaceOptions {
  int span = 5;   ///< A place is a square of span × span cells, ≥ 1.
  int count = 3;  ///< Maximum number of places, ≥ 0.
};

/// Predicted leakage of a place if one thing were changed.
struct LeakTrial {
  std::string change;      ///< "a 0.3 mm ball"
  double leakage = 0.0;    ///< As LeakPlace::leakage, all else unchanged.
  double dark_flux = 0.0;  ///< As LeakPlace::dark_flux.
  double moves = 1.0;      ///< Moves of the whole lens's finishing with the change ÷ without it.
  double minutes = 1.0;    ///< The same for its minutes at the finishing feed.
};

/// A part of the lens from which light leaks.
struct LeakPlace {
  CellRange cells;                  ///< Of the rendered grid.
  Eigen::Vector2d place{0.0, 0.0};  ///< Source of most of it, mm on the lens.
  double side = 0.0;                ///< Of the square, mm.
  double leakage = 0.0;    ///< Share of the lens's flux that leaves here and lands where the design
                           ///< puts less, minus the designed share.
  double dark_flux = 0.0;  ///< The same for the dark pixels.
  HeightDifference height;          ///< Largest difference of height in the worst cell.
  Eigen::Vector2d lands{0.0, 0.0};  ///< Centre of that light, pixel coordinates.
  std::vector<CausePart> parts;     ///< `leakage` and `dark_flux` by cause; dark_ratio stays 0.
  std::vector<LeakTrial> trials;    ///< Of remedies, if any were tried.
};

/// The places that leak most, worst first, at least a square's side apart. `map` gives the places,
/// the chain the causes. @throw Interrupted as the executor does.
std::vector<LeakPlace> worst_places(const LeakMap& map, const LeakageChain& chain,
                                    const LeakageResult& result, const FieldRenderSetup& setup,
                                    const LeakPlaceOptions& options, const Executor& executor);

}  // namespace lensforge
