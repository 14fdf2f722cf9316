// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/surface_mesh.h"

/// How the rows of a grid mesh are shared out over ranks. The vertices of a rank lie together, and
/// so do its faces, as both are numbered row by row.
namespace lensforge {

/// Rows of vertices on each side that a rank keeps of its neighbours'. As far reaches what a
/// vertex's gradient hangs on: a face's bend takes in its neighbours', whose fits take in theirs,
/// and three sweeps of weights each go one face further, two faces to a row. With one row fewer the
/// gradient is another (GradientOnRanks).
inline constexpr int kHaloRows = 4;

/// Numbers begin … end − 1.
struct ItemRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;

  [[nodiscard]] std::int64_t count() const { return end - begin; }
  [[nodiscard]] bool contains(std::int64_t i) const { return i >= begin && i < end; }
  /// The same, counted from `origin`.
  [[nodiscard]] ItemRange from(std::int64_t origin) const { return {begin - origin, end - origin}; }
};

/// Part `rank` of `total` items that are shared out evenly over `ranks`.
inline ItemRange even_share(std::int64_t total, int ranks, int rank) {
  return {total * rank / ranks, total * (rank + 1) / ranks};
}

/// What one rank holds of a grid mesh: the rows that it owns and a halo of kHaloRows around them.
/// Its own mesh of these numbers vertices and faces anew, in the same order.
class RowSlab {
 public:
  RowSlab(const GridShape& grid, int ranks, int rank)
      : grid_(grid), own_rows_(even_share(grid.rows, ranks, rank)), held_rows_(own_rows_) {
    held_rows_.begin = own_rows_.begin < kHaloRows ? 0 : own_rows_.begin - kHaloRows;
    held_rows_.end = own_rows_.end + kHaloRows < grid.rows ? own_rows_.end + kHaloRows : grid.rows;
  }

  /// Whether every rank owns as many rows as its neighbours keep of it.
  [[nodiscard]] static bool suffices(const GridShape& grid, int ranks) {
    return grid.rows / ranks >= kHaloRows;
  }

  [[nodiscard]] const GridShape& grid() const { return grid_; }  ///< Of the whole.
  [[nodiscard]] GridShape held_grid() const {
    return {grid_.columns, static_cast<int>(held_rows_.count())};
  }
  [[nodiscard]] ItemRange own_rows() const { return own_rows_; }
  [[nodiscard]] ItemRange held_rows() const { return held_rows_; }

  // In the numbers of the whole mesh.
  [[nodiscard]] ItemRange own_vertices() const { return vertices_of(own_rows_); }
  [[nodiscard]] ItemRange held_vertices() const { return vertices_of(held_rows_); }
  /// Faces above the rows that are owned.
  [[nodiscard]] ItemRange own_faces() const {
    return faces_of({own_rows_.begin, own_rows_.end < grid_.rows ? own_rows_.end + 1 : grid_.rows});
  }
  [[nodiscard]] ItemRange held_faces() const { return faces_of(held_rows_); }

  // In those of the rank's own mesh.
  [[nodiscard]] ItemRange own_vertices_here() const {
    return own_vertices().from(held_vertices().begin);
  }
  [[nodiscard]] ItemRange own_faces_here() const { return own_faces().from(held_faces().begin); }

 private:
  [[nodiscard]] ItemRange vertices_of(const ItemRange& rows) const {
    return {rows.begin * grid_.columns, rows.end * grid_.columns};
  }
  /// Between the first and the last of these rows of vertices.
  [[nodiscard]] ItemRange faces_of(const ItemRange& rows) const {
    const std::int64_t per_row = std::int64_t{2} * (grid_.columns - 1);
    return {rows.begin * per_row, (rows.end - 1) * per_row};
  }

  GridShape grid_;
  ItemRange own_rows_;
  ItemRange held_rows_;
};

/// Whether a mesh's faces lie row by row between their rows of vertices, as make_grid_mesh() has
/// them.
inline bool has_row_order(const SurfaceMesh& mesh) {
  const GridShape& grid = mesh.grid;
  const std::int64_t per_row = std::int64_t{2} * (grid.columns - 1);
  if (!grid.is_grid() || mesh.triangle_count() != per_row * (grid.rows - 1)) return false;
  for (std::int64_t f = 0; f < mesh.triangle_count(); ++f) {
    const std::int64_t row = f / per_row;
    for (const int v : mesh.triangles.col(f)) {
      if (v / grid.columns < row || v / grid.columns > row + 1) return false;
    }
  }
  return true;
}

}  // namespace lensforge
