// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

/// Vertex positions of a lens's flat grid: rows of near-equilateral triangles.
namespace lensforge {

/// Cells next to the border over which the half-cell shift of odd rows grows from 0 to full.
inline constexpr int kShiftFade = 4;

/// x of a flat grid's vertex, in cells: every other row is moved half a cell to the right, and near
/// the left and right border the shift fades out, so that all rows end on the border.
inline double rest_column(int column, int row, int cells) {
  const int from_border = std::min(column, cells - column);
  const double shift = 0.5 * std::min(1.0, static_cast<double>(from_border) / kShiftFade);
  return column + (row % 2 == 1 ? shift : 0.0);
}

/// Position of x (in cells) in a row: a column and the fraction to the next one.
struct RowPosition {
  int column = 0;
  double fraction = 0.0;
};

/// @pre cells ≥ 1.
inline RowPosition locate_in_row(double x, int row, int cells) {
  int column = std::clamp(static_cast<int>(x), 0, cells - 1);
  while (column > 0 && rest_column(column, row, cells) > x) --column;
  const double left = rest_column(column, row, cells);
  const double right = rest_column(column + 1, row, cells);
  return {column, std::clamp((x - left) / (right - left), 0.0, 1.0)};
}

}  // namespace lensforge
