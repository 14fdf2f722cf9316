// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cam/milled/rounded_field.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// A place that the ball cannot reach.
struct CreaseSpot {
  Eigen::Vector2d place{0.0, 0.0};  ///< mm
  double depth = 0.0;  ///< Left standing above the designed surface, mm; the most in its cell.
  double width = 0.0;  ///< Of the fillet there, mm.
};

/// How a crease map is drawn.
struct CreaseMapOptions {
  double cell = 0.5;       ///< Side of the map's cells, mm, > 0.
  std::size_t spots = 20;  ///< Worst places listed at most.
  double apart = 3.0;      ///< Least distance of two of them, mm.
};

/// Where concave creases keep material, over the whole lens.
struct CreaseMap {
  bool complete = false;  ///< False if it was stopped.
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  double cell = 0.0;                 ///< mm
  Eigen::Vector2d origin{0.0, 0.0};  ///< Least corner of the first cell, mm.
  std::vector<float> depth;          ///< Deepest in each cell, mm, row by row from the least y.
  std::vector<float> share;          ///< Of each cell's nodes that lie in a fillet.
  double fillets = 0.0;              ///< Share of all nodes: of the light that is concerned.
  std::vector<CreaseSpot> worst;     ///< Deepest first.
};

/// Samples a grid, tile by tile, for what the ball leaves in creases.
CreaseMap map_creases(const RoundedField& field, const GridWindow& grid,
                      const CreaseMapOptions& options, const Executor& executor,
                      const RunControl& control);

}  // namespace lensforge
