// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/surface_field.h"

namespace lensforge {

/// Meeting point of two smooth pieces of surface between two points, as a share of the way from the
/// first to the second. @param at_first  height of the second's piece, continued, above the
/// first's, at the first point. @param at_second  the same at the second point.
///
/// For two cuts of one ball the difference of their heights is linear along the way, so its zero is
/// exact. Without a change of sign the pieces touch (a fillet that runs into a face): the
/// difference is a parabola with a double root, which its square roots find.
double meeting_share(double at_first, double at_second);

/// Corrects the heights of a patch beside creases so that sums of them with smooth weights (as in
/// polishing) depend on where the crease runs between its two nodes.
///
/// h times the sum of a smooth function over nodes h apart is its integral, apart from an
/// exponentially small error. A crease at θh behind a node, where the slope jumps by J, makes it
/// too large by
///
///     −½ J h² B₂(θ) w + ⅓ J h³ B₃(θ) w′ + O(h⁴)     (Euler–Maclaurin, ends at the crease)
///
/// with the weight w and its derivative there and the Bernoulli polynomials B₂ and B₃. As the
/// crests of scallops wander over the nodes on a curved surface, θ changes and slopes are off by up
/// to ½ h times the curvature across the passes. The heights of the two nodes are lowered by both
/// terms. A crease is corrected along the grid axis with the larger part of its jump: sums along
/// that axis are smooth along the other. Tests: PolishedField.ARidgeCountsWhereItRunsBetweenNodes
/// and CrestsThatWanderOverTheNodesMakeNoWave.
///
/// The nodes at either end of a line and creases beside them are left unchanged: the lens's rim,
/// about which heights are turned, needs no correction, and the slope there is that of any of the
/// passes that roll over it. At a window's border inside the lens the kCreaseHalo outer nodes lack
/// the corrections from beyond. Does nothing to a patch without pieces.
void correct_crease_sums(const Executor& executor, SurfacePatch& patch);

/// Nodes next to a window's border whose heights differ from those in a larger window.
inline constexpr std::int64_t kCreaseHalo = 2;

/// A place that the ball cannot reach.
struct CreaseSpot {
  Eigen::Vector2d place{0.0, 0.0};  ///< mm
  double depth = 0.0;  ///< Remaining material above the designed surface, mm; maximum in the cell.
  double width = 0.0;  ///< Of the fillet there, mm.
};

/// Options of a crease map.
struct CreaseMapOptions {
  double cell = 0.5;       ///< Side of the map's cells, mm, > 0.
  std::size_t spots = 20;  ///< Maximum number of places listed.
  double apart = 3.0;      ///< Minimum distance between two of them, mm.
};

/// Remaining material in concave creases over the whole lens.
struct CreaseMap {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  double cell = 0.0;                 ///< mm
  Eigen::Vector2d origin{0.0, 0.0};  ///< Least corner of the first cell, mm.
  std::vector<float> depth;          ///< Deepest in each cell, mm, row by row from the least y.
  std::vector<float> share;          ///< Share of each cell's nodes that lie in a fillet.
  double fillets = 0.0;              ///< Share of all nodes: the share of light affected.
  std::vector<CreaseSpot> worst;     ///< Deepest first.
};

/// Draws the map of a grid from the tiles that a rounded surface is sampled in.
class CreaseMapper {
 public:
  /// @pre options.cell > 0.
  CreaseMapper(const GridWindow& grid, const CreaseMapOptions& options);

  /// Takes the nodes of a tile of the grid; tiles may overlap only at their rims.
  /// @param patch  with depth and width; may reach beyond the tile.
  void add(const CellRange& tile, const SurfacePatch& patch, const Executor& executor);

  [[nodiscard]] CreaseMap map() const;

 private:
  /// State of a cell while tiles arrive.
  struct Cell {
    CreaseSpot deepest;
    std::int64_t nodes = 0;
    std::int64_t fillets = 0;
  };
  /// Cell that a coordinate lies in, along an axis.
  [[nodiscard]] std::int64_t cell_at(double at, int axis) const;
  void add_row(const SurfacePatch& patch, std::int64_t row, std::int64_t begin, std::int64_t end);
  [[nodiscard]] std::vector<CreaseSpot> worst() const;

  CreaseMapOptions options_;
  GridWindow grid_;
  std::int64_t columns_ = 0;
  std::int64_t rows_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace lensforge
