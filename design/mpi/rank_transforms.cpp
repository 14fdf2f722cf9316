// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/rank_transforms.h"

#include <algorithm>

namespace lensforge {
namespace {

int length_of(const ItemRange& range) { return static_cast<int>(range.count()); }

std::size_t size_of(const ItemRange& range, int length) {
  return static_cast<std::size_t>(range.count()) * static_cast<std::size_t>(length);
}

}  // namespace

RankTransforms::RankTransforms(const GridShape& grid, const Ranks& ranks, const Executor& threads)
    : grid_(grid),
      ranks_(ranks),
      threads_(threads),
      along_rows_(grid.columns, length_of(rows())),
      along_columns_(grid.rows, length_of(columns())) {
  for (int r = 0; r < ranks.count(); ++r) {
    by_row_owner_.push_back(static_cast<int>(rows_of(r).count() * columns().count()));
    by_column_owner_.push_back(static_cast<int>(rows().count() * columns_of(r).count()));
  }
  const std::size_t most = std::max(size_of(rows(), grid.columns), size_of(columns(), grid.rows));
  for (std::vector<double>& plane : planes_) plane.resize(most);
  packed_.resize(most);
}

void RankTransforms::forward() {
  transform(along_rows_);
  for (std::vector<double>& plane : planes_) to_columns(plane);
  transform(along_columns_);
}

void RankTransforms::backward() {
  for (std::vector<double>& plane : planes_) to_rows(plane);
  forward();
  for (std::vector<double>& plane : planes_) to_rows(plane);
}

void RankTransforms::transform(const CosineRows& lines) {
  parallel_for(
      threads_, "cosine transform", 3,
      [&](std::int64_t k) { lines.run(plane(static_cast<int>(k))); }, 1);
}

/// On the way a block holds, column by column, what one rank has of the rows and another takes of
/// the columns.
void RankTransforms::to_columns(std::vector<double>& plane) {
  double* block = packed_.data();
  for (std::int64_t c = 0; c < grid_.columns; ++c) {
    const double* value = plane.data() + c;
    for (std::int64_t r = 0; r < rows().count(); ++r, value += grid_.columns) *block++ = *value;
  }
  const std::size_t out = size_of(rows(), grid_.columns);
  const std::size_t in = size_of(columns(), grid_.rows);
  ranks_.exchange({packed_.data(), out}, by_column_owner_, {plane.data(), in}, by_row_owner_);
  std::copy(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(in), packed_.begin());
  const double* from = packed_.data();
  for (int rank = 0; rank < ranks_.count(); ++rank) {
    const ItemRange rows = rows_of(rank);
    for (std::int64_t c = 0; c < columns().count(); ++c, from += rows.count()) {
      std::copy(from, from + rows.count(), plane.data() + c * grid_.rows + rows.begin);
    }
  }
}

void RankTransforms::to_rows(std::vector<double>& plane) {
  double* to = packed_.data();
  for (int rank = 0; rank < ranks_.count(); ++rank) {
    const ItemRange rows = rows_of(rank);
    for (std::int64_t c = 0; c < columns().count(); ++c) {
      const double* column = plane.data() + c * grid_.rows;
      to = std::copy(column + rows.begin, column + rows.end, to);
    }
  }
  const std::size_t out = size_of(columns(), grid_.rows);
  const std::size_t in = size_of(rows(), grid_.columns);
  ranks_.exchange({packed_.data(), out}, by_row_owner_, {plane.data(), in}, by_column_owner_);
  std::copy(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(in), packed_.begin());
  const double* block = packed_.data();
  for (std::int64_t c = 0; c < grid_.columns; ++c) {
    double* value = plane.data() + c;
    for (std::int64_t r = 0; r < rows().count(); ++r, value += grid_.columns) *value = *block++;
  }
}

}  // namespace lensforge
