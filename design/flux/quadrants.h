// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"
#include "design/optics/image_triangle.h"

/// Triangles that touch at most 2 × 2 pixels, in closed form and without branches that depend on
/// where the triangle lies: most triangles of a fine mesh are of this kind, and a mispredicted
/// branch costs as much as all the arithmetic of an edge.
///
/// Notation: X and Y are the pixel borders that cross the triangle's box; a quadrant is one of the
/// four parts they cut the plane into. An edge runs a → b with parameter s.
namespace lensforge::flux_detail {

LF_HD inline double least(double a, double b) { return a < b ? a : b; }
LF_HD inline double most(double a, double b) { return a > b ? a : b; }

/// Floor of a value that an int can hold; a library call where the processor has no instruction.
LF_HD inline int floor_to_int(double value) {
  const int truncated = static_cast<int>(value);
  return truncated - (value < truncated ? 1 : 0);
}

/// Smallest box of whole pixels around a triangle.
struct PixelBox {
  int c0, c1, r0, r1;
  double x0, x1, y0, y1;

  LF_HD explicit PixelBox(const ImageTriangle& t)
      : x0(least(t.p0.x(), least(t.p1.x(), t.p2.x()))),
        x1(most(t.p0.x(), most(t.p1.x(), t.p2.x()))),
        y0(least(t.p0.y(), least(t.p1.y(), t.p2.y()))),
        y1(most(t.p0.y(), most(t.p1.y(), t.p2.y()))) {
    c0 = cell(x0);
    c1 = cell(x1);
    r0 = cell(y0);
    r1 = cell(y1);
  }
  /// Column or row of a coordinate, kept within what an int can hold.
  LF_HD static int cell(double value) { return floor_to_int(least(most(value, -1e9), 1e9)); }

  /// True if nothing of the triangle can lie in the picture, or a corner is not finite.
  [[nodiscard]] LF_HD bool misses(const ImageTriangle& t, int columns, int rows) const {
    const double sum = t.p0.sum() + t.p1.sum() + t.p2.sum();
    return !(x1 >= 0.0 && x0 <= columns && y1 >= 0.0 && y0 <= rows && std::fabs(sum) < 1e300);
  }
  [[nodiscard]] LF_HD bool within_one_pixel() const { return c0 == c1 && r0 == r1; }
  [[nodiscard]] LF_HD bool within_two_by_two() const { return c1 - c0 <= 1 && r1 - r0 <= 1; }
  [[nodiscard]] LF_HD bool inside(int columns, int rows) const {
    return c0 >= 0 && r0 >= 0 && c1 < columns && r1 < rows;
  }
  [[nodiscard]] LF_HD double extent() const { return most(x1 - x0, y1 - y0); }
  /// Where X and Y cross. Without a border in the box the box's own lower side serves: then all of
  /// the triangle is right of X (below Y), and offsets stay small.
  [[nodiscard]] LF_HD Eigen::Vector2d crossing() const {
    return {c0 < c1 ? static_cast<double>(c1) : x0, r0 < r1 ? static_cast<double>(r1) : y0};
  }
};

/// A number for each quadrant; "above" is the row of smaller y.
struct Quadrants {
  double above_left = 0.0;
  double above_right = 0.0;
  double below_left = 0.0;
  double below_right = 0.0;

  [[nodiscard]] LF_HD double sum() const {
    return (above_left + above_right) + (below_left + below_right);
  }
  [[nodiscard]] LF_HD double at(bool right, bool below) const {
    const double above_value = right ? above_right : above_left;
    const double below_value = right ? below_right : below_left;
    return below ? below_value : above_value;
  }
};

/// Adds ∫ min(x, 0) dy and ∫ max(x, 0) dy along a straight piece of height dy whose x runs from u
/// to v. The share of x's range on the right is exactly 0 or 1 where the piece does not cross.
LF_HD inline void add_piece(double u, double v, double dy, double& left, double& right) {
  const double u_right = most(u, 0.0);
  const double v_right = most(v, 0.0);
  const double range = u - v;
  const double share = range == 0.0 ? (u > 0.0 ? 1.0 : 0.0) : (u_right - v_right) / range;
  const double half = 0.5 * dy;
  right += half * (u_right + v_right) * share;
  left += half * ((u - u_right) + (v - v_right)) * (1.0 - share);
}

/// Adds an edge's part of ∮ x dy to every quadrant; over a closed polygon the sums are the signed
/// areas. a and b are relative to the crossing of X and Y.
LF_HD inline void add_edge(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Quadrants& areas) {
  const double a_above = least(a.y(), 0.0);
  const double b_above = least(b.y(), 0.0);
  const bool crosses = (a.y() < 0.0) != (b.y() < 0.0);
  const double fall = crosses ? a.y() - b.y() : 1.0;
  const double x = a.x() + (b.x() - a.x()) * (a.y() / fall);
  const bool from_above = a.y() < 0.0;
  const bool to_above = b.y() < 0.0;
  add_piece(from_above ? a.x() : x, to_above ? b.x() : x, b_above - a_above, areas.above_left,
            areas.above_right);
  add_piece(from_above ? x : a.x(), to_above ? x : b.x(), (b.y() - b_above) - (a.y() - a_above),
            areas.below_left, areas.below_right);
}

/// Signed areas of a triangle's parts. @pre the triangle lies within the box's 2 × 2 pixels.
LF_HD inline Quadrants quadrant_areas(const ImageTriangle& t, const Eigen::Vector2d& crossing) {
  const Eigen::Vector2d a = t.p0 - crossing;
  const Eigen::Vector2d b = t.p1 - crossing;
  const Eigen::Vector2d c = t.p2 - crossing;
  Quadrants areas;
  add_edge(a, b, areas);
  add_edge(b, c, areas);
  add_edge(c, a, areas);
  return areas;
}

/// Parameter at which a coordinate that runs from `from` to `to` changes sign; 1 if it does not. It
/// divides in any case, since a branch around a division stays one.
LF_HD inline double crossing_parameter(double from, double to) {
  const bool crosses = (from < 0.0) != (to < 0.0);
  const double share = from / (crosses ? from - to : 1.0);
  return crosses ? share : 1.0;
}

/// ∫ g (1 − s) ds and ∫ g s ds along an edge, g constant in every quadrant.
struct HatWeights {
  double start;
  double end;

  LF_HD HatWeights(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Quadrants& g) {
    const double sx = crossing_parameter(a.x(), b.x());
    const double sy = crossing_parameter(a.y(), b.y());
    const double s0 = least(sx, sy);
    const double s1 = most(sx, sy);
    const bool right_a = a.x() >= 0.0;
    const bool right_b = b.x() >= 0.0;
    const bool below_a = a.y() >= 0.0;
    const bool below_b = b.y() >= 0.0;
    const double first = g.at(right_a, below_a);
    const double middle = sx < sy ? g.at(right_b, below_a) : g.at(right_a, below_b);
    const double last = g.at(right_b, below_b);
    const double whole = first * s0 + middle * (s1 - s0) + last * (1.0 - s1);
    end = 0.5 * (first * s0 * s0 + middle * (s1 - s0) * (s1 + s0) + last * (1.0 - s1) * (1.0 + s1));
    start = whole - end;
  }
};

}  // namespace lensforge::flux_detail
