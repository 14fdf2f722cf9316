// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// A rectangle of nodes of a regular grid: node (i, j) of the window lies at origin + spacing ·
/// (first_column + i, first_row + j), so it has the same coordinates, to the bit, in every window
/// of the grid.
struct GridWindow {
  Eigen::Vector2d origin{0.0, 0.0};   ///< Of the grid, mm.
  Eigen::Vector2d spacing{0.0, 0.0};  ///< mm
  std::int64_t columns = 0;           ///< Nodes along x.
  std::int64_t rows = 0;              ///< Nodes along y.
  std::int64_t first_column = 0;      ///< Of the window, in the grid.
  std::int64_t first_row = 0;

  [[nodiscard]] double x(std::int64_t i) const {
    return origin.x() + spacing.x() * static_cast<double>(first_column + i);
  }
  [[nodiscard]] double y(std::int64_t j) const {
    return origin.y() + spacing.y() * static_cast<double>(first_row + j);
  }
  [[nodiscard]] Eigen::Vector2d node(std::int64_t i, std::int64_t j) const { return {x(i), y(j)}; }
  [[nodiscard]] std::int64_t size() const { return columns * rows; }
};

/// Heights and slopes at the nodes of a window, row by row from the least y.
struct SurfacePatch {
  GridWindow window;
  std::vector<double> z;        ///< mm, lens frame.
  std::vector<double> slope_x;  ///< ∂z/∂x, of the surface itself, not a difference of heights.
  std::vector<double> slope_y;  ///< ∂z/∂y
  /// Number of the piece that the node lies on. Nodes of one smooth piece share it; between nodes
  /// of two pieces the slope may jump. Empty where the whole surface is smooth.
  std::vector<std::int32_t> cut;
  // What a ball cannot reach on a surface that it rounds (RoundedField), or on one cast in that;
  // else empty.
  std::vector<double> depth;  ///< Remaining material above the designed surface, mm; 0 where
                              ///< reached.
  std::vector<double> width;  ///< Of the fillet: largest distance of its ball's contacts, mm; or 0.
};

/// Makes room for a window's nodes. @param cuts  true if the surface has pieces.
inline void resize_patch(const GridWindow& window, bool cuts, SurfacePatch& patch) {
  const auto count = static_cast<std::size_t>(window.size());
  patch.window = window;
  patch.z.resize(count);
  patch.slope_x.resize(count);
  patch.slope_y.resize(count);
  patch.cut.resize(cuts ? count : 0);
  patch.depth.clear();
  patch.width.clear();
}

/// A surface that can be sampled at any resolution, window by window, so that a whole lens never
/// has to be in memory: the designed surface, what a ball can reach of it, what a program leaves,
/// the polished surface.
class SurfaceField {
 public:
  SurfaceField() = default;
  SurfaceField(const SurfaceField&) = delete;
  SurfaceField& operator=(const SurfaceField&) = delete;
  virtual ~SurfaceField() = default;

  /// Fills `patch` for a window inside the lens's rectangle; the same bits for any division of the
  /// grid into windows and any number of threads. @throw Interrupted as the executor does.
  virtual void sample(const GridWindow& window, const Executor& executor,
                      SurfacePatch& patch) const = 0;
};

/// The grid over a lens's rectangle from (0, 0) whose nodes are at most `spacing` apart, mm, the
/// last ones on the rim and none beyond.
/// @throw InputError unless both sides are positive, at most 1 m, and the spacing is from 0.1 µm
///        up.
GridWindow lens_grid(const Eigen::Vector2d& size, double spacing);

/// The same with a spacing of its own along x and y.
GridWindow lens_grid(const Eigen::Vector2d& size, const Eigen::Vector2d& spacing);

/// A rectangle of cells of a grid; cell (i, j) lies between nodes (i, j) and (i + 1, j + 1).
struct CellRange {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

/// The part of a grid that holds a range's nodes and up to `halo` more on every side.
GridWindow window_of(const GridWindow& grid, const CellRange& range, std::int64_t halo);

/// Every cell of a grid.
CellRange all_cells(const GridWindow& grid);

/// Cells along x and y.
using CellCounts = Eigen::Matrix<std::int64_t, 2, 1>;

/// Cuts a range into tiles of at most `sides` cells, row by row. @pre sides > 0.
std::vector<CellRange> tiles_of(const CellRange& range, const CellCounts& sides);
std::vector<CellRange> tiles_of(const CellRange& range, std::int64_t side);

/// A surface that keeps the last window it sampled, for surfaces that are made from it tile by
/// tile. The largest window should be sampled first. Not for several threads at once.
class HeldField final : public SurfaceField {
 public:
  /// @param field  must outlive this.
  explicit HeldField(const SurfaceField& field) : field_(field) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const SurfaceField& field_;
  mutable SurfacePatch held_;
};

/// A surface without creases, node by node.
class OpticalField final : public SurfaceField {
 public:
  /// @param surface  must outlive the field. @pre not surface.has_creases()
  explicit OpticalField(const OpticalSurface& surface) : surface_(surface) {}

  /// Nodes beside the surface take the height and slopes of the nearest point of its rectangle.
  /// @throw InputError naming a node above or below which a jagged rim leaves nothing.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const OpticalSurface& surface_;
};

/// The sampled surface as a grid mesh: two triangles between four nodes.
SurfaceMesh mesh_of(const SurfacePatch& patch);

}  // namespace lensforge
