// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "design/mpi/rank_transforms.h"
#include "design/optimize/grid_preconditioner.h"

namespace lensforge {

/// GridPreconditioner over ranks. Vectors hold the vertices that the rank owns. apply() is
/// collective.
class RankPreconditioner {
 public:
  /// @param aspect   cell height ÷ cell width of the grid.
  /// @param movable  3 per vertex, 1 or 0.
  RankPreconditioner(const GridShape& grid, double aspect, std::span<const double> movable,
                     const Ranks& ranks, const Executor& threads);

  GridSymbol xy;
  GridSymbol z;

  void set_reach(std::span<const double> reach);
  void set_movable(std::span<const double> movable);

  /// r ← P^exponent g.
  void apply(std::span<const double> g, double exponent, std::span<double> r);

 private:
  [[nodiscard]] PreconditionerView view_of_rows(double exponent);
  [[nodiscard]] PreconditionerView view_of_columns(double exponent);

  GridShape grid_;
  Executor threads_;
  std::vector<double> movable_;
  std::vector<double> reach_;
  std::vector<double> eigen_x_;
  std::vector<double> eigen_y_;
  RankTransforms transforms_;
};

}  // namespace lensforge
