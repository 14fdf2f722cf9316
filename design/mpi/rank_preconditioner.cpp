// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/rank_preconditioner.h"

#include <cmath>

namespace lensforge {

RankPreconditioner::RankPreconditioner(const GridShape& grid, double aspect,
                                       std::span<const double> movable, const Ranks& ranks,
                                       const Executor& threads)
    : grid_(grid),
      threads_(threads),
      movable_(movable.begin(), movable.end()),
      reach_(movable.size(), 1.0),
      eigen_x_(CosineTransform::eigenvalues(grid.columns, 1.0)),
      eigen_y_(CosineTransform::eigenvalues(grid.rows, aspect)),
      transforms_(grid, ranks, threads) {}

void RankPreconditioner::set_reach(std::span<const double> reach) {
  reach_.assign(reach.begin(), reach.end());
}

void RankPreconditioner::set_movable(std::span<const double> movable) {
  movable_.assign(movable.begin(), movable.end());
}

void RankPreconditioner::apply(std::span<const double> g, double exponent, std::span<double> r) {
  const auto vertices = static_cast<std::int64_t>(reach_.size() / 3);
  const PreconditionerView rows = view_of_rows(exponent);
  parallel_for(threads_, "enter planes", vertices, EnterPlanes{rows, g.data()});
  transforms_.forward();
  const double inverse = 1.0 / (4.0 * (grid_.columns - 1.0) * (grid_.rows - 1.0));
  const double scale_xy = std::pow(xy.scale, exponent) * inverse;
  const double scale_z = std::pow(z.scale, exponent) * inverse;
  parallel_for(threads_, "scale coefficients", transforms_.columns().count() * grid_.rows,
               ScaleCoefficient{view_of_columns(exponent), {scale_xy, scale_xy, scale_z}});
  transforms_.backward();
  parallel_for(threads_, "leave planes", vertices, LeavePlanes{rows, r.data()});
}

PreconditionerView RankPreconditioner::view_of_rows(double exponent) {
  return {grid_.columns,
          grid_.rows,
          movable_.data(),
          reach_.data(),
          eigen_x_.data(),
          eigen_y_.data(),
          {xy, xy, z},
          exponent,
          {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)},
          transforms_.rows().begin};
}

/// The planes transposed: rows and columns change their parts.
PreconditionerView RankPreconditioner::view_of_columns(double exponent) {
  return {grid_.rows,
          grid_.columns,
          nullptr,
          nullptr,
          eigen_y_.data(),
          eigen_x_.data(),
          {xy, xy, z},
          exponent,
          {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)},
          transforms_.columns().begin};
}

}  // namespace lensforge
