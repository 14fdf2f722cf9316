// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"

/// Walks a straight edge through the pixels it crosses.
///
/// Notation: the edge runs p → q with parameter s from 0 to 1; pixel (column c, row r) covers
/// [c, c+1] × [r, r+1]; a *piece* is the part of the edge inside one pixel. At a row boundary a
/// piece's y is exactly that integer, and neighbouring pieces share their end points to the bit, so
/// that sums over a closed polygon telescope exactly.
namespace lensforge {

/// One piece of an edge. `column` is −1 for a piece left of the picture; of such a piece only row,
/// y0 and y1 mean anything.
struct EdgePiece {
  int column;
  int row;
  double s0, s1;  ///< Parameters of its ends.
  double x0, y0;  ///< Its ends, in pixel coordinates.
  double x1, y1;
};

namespace edge_walk_detail {

/// State of the walk along one axis: the next grid line and where the edge meets it.
struct Axis {
  int cell, last, step;  ///< Current cell, final cell, direction of travel.
  double origin, inverse;

  LF_HD Axis(double from, double to, double p, double delta, int limit)
      : cell(clamp_cell(from, limit)), last(clamp_cell(to, limit)), origin(p) {
    step = last >= cell ? 1 : -1;
    inverse = cell == last ? 0.0 : 1.0 / delta;
  }

  [[nodiscard]] LF_HD bool at_end() const { return cell == last; }
  [[nodiscard]] LF_HD double next_line() const { return step > 0 ? cell + 1 : cell; }
  [[nodiscard]] LF_HD double parameter_at_next_line() const {
    return (next_line() - origin) * inverse;
  }
  /// Largest cell is limit − 1: a point on the far border belongs to the last cell.
  LF_HD static int clamp_cell(double value, int limit) {
    const int cell = static_cast<int>(std::floor(value));
    return cell < 0 ? 0 : (cell >= limit ? limit - 1 : cell);
  }
};

/// Visits the pieces of the part s0 … s1 of p → q, which lies inside columns × rows.
template <class Visit>
LF_HD inline void walk_inside(const Eigen::Vector2d& p, const Eigen::Vector2d& d, EdgePiece part,
                              int columns, int rows, Visit& visit) {
  Axis u(part.x0, part.x1, p.x(), d.x(), columns);
  Axis v(part.y0, part.y1, p.y(), d.y(), rows);
  EdgePiece piece = part;
  while (!u.at_end() || !v.at_end()) {
    const double su = u.at_end() ? 2.0 : u.parameter_at_next_line();
    const double sv = v.at_end() ? 2.0 : v.parameter_at_next_line();
    piece.column = u.cell;
    piece.row = v.cell;
    const bool cross_row = sv <= su;
    // Rounding may put a crossing outside the remaining part; the order of cells is what counts.
    const double s = clamped(cross_row ? sv : su, piece.s0, part.s1);
    piece.s1 = s;
    piece.x1 = cross_row ? p.x() + s * d.x() : u.next_line();
    piece.y1 = cross_row ? v.next_line() : p.y() + s * d.y();
    // Keep the end inside this row (and column), whatever the rounding.
    if (cross_row) {
      piece.x1 = clamped(piece.x1, u.cell, u.cell + 1.0);
      v.cell += v.step;
    } else {
      piece.y1 = clamped(piece.y1, v.cell, v.cell + 1.0);
      u.cell += u.step;
    }
    visit(piece);
    piece.s0 = piece.s1;
    piece.x0 = piece.x1;
    piece.y0 = piece.y1;
  }
  piece.column = u.cell;
  piece.row = v.cell;
  piece.s1 = part.s1;
  piece.x1 = part.x1;
  piece.y1 = part.y1;
  visit(piece);
}

/// Visits, row by row, a part that lies left of the picture.
template <class Visit>
LF_HD inline void walk_left(const Eigen::Vector2d& p, const Eigen::Vector2d& d, EdgePiece part,
                            int rows, Visit& visit) {
  Axis v(part.y0, part.y1, p.y(), d.y(), rows);
  EdgePiece piece = part;
  piece.column = -1;
  for (; !v.at_end(); v.cell += v.step) {
    piece.row = v.cell;
    piece.y1 = v.next_line();
    visit(piece);
    piece.y0 = piece.y1;
  }
  piece.row = v.cell;
  piece.y1 = part.y1;
  visit(piece);
}

/// Cuts `part` at the vertical line x = line: returns the part before, leaves the rest in `part`.
LF_HD inline EdgePiece cut_at_column(const Eigen::Vector2d& p, const Eigen::Vector2d& d,
                                     double line, EdgePiece& part) {
  EdgePiece before = part;
  const double s = clamped((line - p.x()) / d.x(), part.s0, part.s1);
  const bool falls = part.y1 < part.y0;
  const double low = falls ? part.y1 : part.y0;
  const double high = falls ? part.y0 : part.y1;
  before.s1 = part.s0 = s;
  before.x1 = part.x0 = line;
  before.y1 = part.y0 = clamped(p.y() + s * d.y(), low, high);
  return before;
}

/// Visits a part whose rows are inside the picture, given that it does not cross x = 0 or
/// x = columns. What is right of the picture is dropped.
template <class Visit>
LF_HD inline void walk_part(const Eigen::Vector2d& p, const Eigen::Vector2d& d,
                            const EdgePiece& part, int columns, int rows, Visit& visit) {
  const double middle = 0.5 * (part.x0 + part.x1);
  if (middle < 0.0) {
    walk_left(p, d, part, rows, visit);
  } else if (middle <= columns) {
    walk_inside(p, d, part, columns, rows, visit);
  }
}

/// Cuts p → q to 0 ≤ y ≤ rows. Returns false if nothing is left.
LF_HD inline bool clip_rows(const Eigen::Vector2d& p, const Eigen::Vector2d& q, int rows,
                            EdgePiece& part) {
  const Eigen::Vector2d d = q - p;
  part = {0, 0, 0.0, 1.0, p.x(), p.y(), q.x(), q.y()};
  const double limit = rows;
  if ((p.y() < 0.0 && q.y() < 0.0) || (p.y() > limit && q.y() > limit)) return false;
  if (p.y() < 0.0 || p.y() > limit) {
    part.y0 = p.y() < 0.0 ? 0.0 : limit;
    part.s0 = (part.y0 - p.y()) / d.y();
    part.x0 = p.x() + part.s0 * d.x();
  }
  if (q.y() < 0.0 || q.y() > limit) {
    part.y1 = q.y() < 0.0 ? 0.0 : limit;
    part.s1 = (part.y1 - p.y()) / d.y();
    part.x1 = p.x() + part.s1 * d.x();
  }
  return part.s0 <= part.s1;
}

}  // namespace edge_walk_detail

/// Calls `visit(const EdgePiece&)` for every piece of p → q in a picture of columns × rows pixels,
/// in order. Parts above, below and right of the picture are left out; parts on its left come as
/// pieces of column −1. At most |Δcolumn| + |Δrow| + 3 pieces, some may have length zero.
template <class Visit>
LF_HD inline void walk_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q, int columns,
                            int rows, Visit&& visit) {
  namespace detail = edge_walk_detail;
  const Eigen::Vector2d d = q - p;
  EdgePiece part{};
  if (!detail::clip_rows(p, q, rows, part)) return;
  const double limit = columns;
  const bool rising = d.x() > 0.0;
  const double first = rising ? 0.0 : limit;
  const double second = rising ? limit : 0.0;
  const auto crosses = [&part](double line) {
    return (part.x0 < line && part.x1 > line) || (part.x0 > line && part.x1 < line);
  };
  if (crosses(first)) {
    detail::walk_part(p, d, detail::cut_at_column(p, d, first, part), columns, rows, visit);
  }
  if (crosses(second)) {
    detail::walk_part(p, d, detail::cut_at_column(p, d, second, part), columns, rows, visit);
  }
  detail::walk_part(p, d, part, columns, rows, visit);
}

}  // namespace lensforge
