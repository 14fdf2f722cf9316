// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/mpi/ranks.h"
#include "design/mpi/row_slabs.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

/// GridTransforms over ranks: the cosine transform of three planes whose rows are shared out. Each
/// rank transforms its rows; then the planes are transposed between the ranks, and each transforms
/// the columns that it has now. FFTW takes rows and columns in that order, too: the coefficients
/// have the bits of CosineTransform's. A transform and its inverse take four transpositions; with
/// the inverse's columns first two would do, and its last bits be others.
class RankTransforms {
 public:
  /// @pre at least 2 columns and rows.
  RankTransforms(const GridShape& grid, const Ranks& ranks, const Executor& threads);

  /// Values of coordinate k: those of the rank's rows, row by row, or between forward() and
  /// backward() the coefficients of its columns, column by column, from the top.
  [[nodiscard]] double* plane(int k) { return planes_[static_cast<std::size_t>(k)].data(); }

  [[nodiscard]] ItemRange rows() const { return rows_of(ranks_.rank()); }
  [[nodiscard]] ItemRange columns() const { return columns_of(ranks_.rank()); }

  /// Rows of values → columns of coefficients. Collective, as is the way back.
  void forward();
  /// Coefficients → (inverse scale)⁻¹ × values.
  void backward();

 private:
  [[nodiscard]] ItemRange rows_of(int rank) const {
    return even_share(grid_.rows, ranks_.count(), rank);
  }
  [[nodiscard]] ItemRange columns_of(int rank) const {
    return even_share(grid_.columns, ranks_.count(), rank);
  }
  void transform(const CosineRows& lines);
  void to_columns(std::vector<double>& plane);
  void to_rows(std::vector<double>& plane);

  GridShape grid_;
  Ranks ranks_;
  Executor threads_;
  CosineRows along_rows_;
  CosineRows along_columns_;
  std::vector<int> by_row_owner_;     ///< Values that a rank shares with each other one: of its own
  std::vector<int> by_column_owner_;  ///< columns the others' rows, of its own rows their columns.
  std::array<std::vector<double>, 3> planes_;
  std::vector<double> packed_;
};

}  // namespace lensforge
