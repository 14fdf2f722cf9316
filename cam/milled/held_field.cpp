// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/held_field.h"

#include <algorithm>
#include <cstddef>

namespace lensforge {
namespace {

bool same_grid(const GridWindow& a, const GridWindow& b) {
  return a.origin == b.origin && a.spacing == b.spacing;
}

bool contains(const GridWindow& all, const GridWindow& part) {
  return part.first_column >= all.first_column && part.first_row >= all.first_row &&
         part.first_column + part.columns <= all.first_column + all.columns &&
         part.first_row + part.rows <= all.first_row + all.rows;
}

/// Copies the part of a patch's values that lies in a window.
template <class Value>
void copy_part(const GridWindow& all, const std::vector<Value>& from, const GridWindow& part,
               const Executor& executor, std::vector<Value>& to) {
  to.resize(from.empty() ? 0 : static_cast<std::size_t>(part.size()));
  if (to.empty()) return;
  const std::int64_t column = part.first_column - all.first_column;
  const std::int64_t row = part.first_row - all.first_row;
  const auto copy_row = [&](std::int64_t j) {
    const auto begin = from.begin() + (row + j) * all.columns + column;
    std::copy(begin, begin + part.columns, to.begin() + j * part.columns);
  };
  parallel_for(executor, "held surface", part.rows, copy_row, 16);
}

}  // namespace

void HeldField::sample(const GridWindow& window, const Executor& executor,
                       SurfacePatch& patch) const {
  const GridWindow& all = held_.window;
  if (!same_grid(all, window) || !contains(all, window)) {
    held_.window = {};  // Until the sample is whole.
    field_.sample(window, executor, held_);
    held_.window = window;
  }
  patch.window = window;
  copy_part(all, held_.z, window, executor, patch.z);
  copy_part(all, held_.slope_x, window, executor, patch.slope_x);
  copy_part(all, held_.slope_y, window, executor, patch.slope_y);
  copy_part(all, held_.cut, window, executor, patch.cut);
  copy_part(all, held_.depth, window, executor, patch.depth);
  copy_part(all, held_.width, window, executor, patch.width);
}

}  // namespace lensforge
