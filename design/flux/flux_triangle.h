// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"

namespace lensforge {

/// Image of one surface triangle on the receiving plane: a triangle of uniform irradiance. The same
/// struct holds derivatives of a scalar with respect to these numbers. T is a double, or a vector
/// of the doubles of several triangles (core/compute/lanes.h), each with the same bits.
template <class T>
struct ImageTriangleOf {
  PlaneVector<T> p0{T{}, T{}};  ///< Corners in pixel coordinates (ImagePlane).
  PlaneVector<T> p1{T{}, T{}};
  PlaneVector<T> p2{T{}, T{}};
  T flux{};  ///< Share of the lens's total flux.
};
using ImageTriangle = ImageTriangleOf<double>;

/// The same light in a picture with `scale` times as many pixels each way. For derivatives this is
/// the adjoint.
template <class T>
LF_HD LF_INLINE ImageTriangleOf<T> magnified(const ImageTriangleOf<T>& t, double scale) {
  return {scale * t.p0, scale * t.p1, scale * t.p2, t.flux};
}

/// Twice the signed area of (a, b, c), positive counter-clockwise in a right-handed frame.
LF_HD inline double doubled_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
}

// Walks a straight edge through the pixels it crosses.
//
// Notation: the edge runs p → q with parameter s from 0 to 1; pixel (column c, row r) covers [c,
// c+1] × [r, r+1]; a *piece* is the part of the edge inside one pixel. At a row boundary a piece's
// y is exactly that integer, and neighbouring pieces share their end points to the bit, so sums
// over a closed polygon telescope exactly.

/// One piece of an edge. `column` is −1 for a piece left of the picture; such a piece defines only
/// row, y0 and y1.
struct EdgePiece {
  int column;
  int row;
  double s0, s1;  ///< Parameters of its ends.
  double x0, y0;  ///< Its ends, in pixel coordinates.
  double x1, y1;
};

namespace edge_walk_detail {

/// State of the walk along one axis: the next grid line and the edge's crossing with it.
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
  /// The largest cell is limit − 1: a point on the far border belongs to the last cell.
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
    // Rounding may put a crossing outside the remaining part; only the order of cells matters.
    const double s = clamped(cross_row ? sv : su, piece.s0, part.s1);
    piece.s1 = s;
    piece.x1 = cross_row ? p.x() + s * d.x() : u.next_line();
    piece.y1 = cross_row ? v.next_line() : p.y() + s * d.y();
    // Keep the end inside this row (and column) despite rounding.
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

/// Visits a part whose rows are inside the picture, given that it does not cross x = 0 or x =
/// columns. Parts right of the picture are dropped.
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

namespace flux_detail {

// Triangles that touch at most 2 × 2 pixels, in closed form and without branches that depend on the
// triangle's place: most triangles of a fine mesh are of this kind, and a mispredicted branch costs
// as much as all the arithmetic of an edge.
//
// Notation: X and Y are the pixel borders that cross the triangle's box; a quadrant is one of the
// four parts they cut the plane into. An edge runs a → b with parameter s. T is a double, or a
// vector of doubles of several triangles (flux_batch.cpp), each with the same bits.

template <class T>
LF_HD LF_INLINE T least(const T& a, const T& b) {
  return a < b ? a : b;
}
template <class T>
LF_HD LF_INLINE T most(const T& a, const T& b) {
  return a > b ? a : b;
}

/// Corners of a triangle, or derivatives by them.
template <class T>
struct PlaneTriangle {
  PlaneVector<T> a;
  PlaneVector<T> b;
  PlaneVector<T> c;
};

/// Floor of a value that an int can hold. std::floor() is a library call on processors without an
/// instruction for it.
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
  /// Crossing of X and Y. Without a border in the box the box's own lower side is used: then the
  /// whole triangle is right of X (below Y), and offsets stay small.
  [[nodiscard]] LF_HD Eigen::Vector2d crossing() const {
    return {c0 < c1 ? static_cast<double>(c1) : x0, r0 < r1 ? static_cast<double>(r1) : y0};
  }
};

/// A number for each quadrant; "above" is the row of smaller y.
template <class T>
struct Quadrants {
  T above_left{};
  T above_right{};
  T below_left{};
  T below_right{};

  [[nodiscard]] LF_HD LF_INLINE T sum() const {
    return (above_left + above_right) + (below_left + below_right);
  }
  template <class Mask>
  [[nodiscard]] LF_HD LF_INLINE T at(const Mask& right, const Mask& below) const {
    const T above_value = right ? above_right : above_left;
    const T below_value = right ? below_right : below_left;
    return below ? below_value : above_value;
  }
};

/// Adds ∫ min(x, 0) dy and ∫ max(x, 0) dy along a straight piece of height dy whose x runs from u
/// to v. The share of x's range on the right is exactly 0 or 1 where the piece does not cross.
template <class T>
LF_HD LF_INLINE void add_piece(const T& u, const T& v, const T& dy, T& left, T& right) {
  const T none{};
  const T all = none + 1.0;
  const T u_right = most(u, none);
  const T v_right = most(v, none);
  const T range = u - v;
  const T crossing_share = (u_right - v_right) / range;
  const T level_share = u > none ? all : none;
  const T share = range == none ? level_share : crossing_share;
  const T half = 0.5 * dy;
  right += half * (u_right + v_right) * share;
  left += half * ((u - u_right) + (v - v_right)) * (1.0 - share);
}

/// Adds an edge's part of ∮ x dy to every quadrant; over a closed polygon the sums are the signed
/// areas. a and b are relative to the crossing of X and Y.
template <class T>
LF_HD LF_INLINE void add_edge(const PlaneVector<T>& a, const PlaneVector<T>& b,
                              Quadrants<T>& areas) {
  const T none{};
  const T a_above = least(a.y(), none);
  const T b_above = least(b.y(), none);
  const auto from_above = a.y() < none;
  const auto to_above = b.y() < none;
  const auto crosses = from_above != to_above;
  const T all = none + 1.0;
  const T height = a.y() - b.y();
  const T fall = crosses ? height : all;
  const T x = a.x() + (b.x() - a.x()) * (a.y() / fall);
  const T x_from_above = from_above ? a.x() : x;
  const T x_to_above = to_above ? b.x() : x;
  const T x_from_below = from_above ? x : a.x();
  const T x_to_below = to_above ? x : b.x();
  const T dy_above = b_above - a_above;
  const T dy_below = (b.y() - b_above) - (a.y() - a_above);
  add_piece(x_from_above, x_to_above, dy_above, areas.above_left, areas.above_right);
  add_piece(x_from_below, x_to_below, dy_below, areas.below_left, areas.below_right);
}

/// Signed areas of a triangle's parts. @pre the triangle lies within 2 × 2 pixels.
template <class T>
LF_HD LF_INLINE Quadrants<T> quadrant_areas(const PlaneTriangle<T>& t) {
  Quadrants<T> areas;
  add_edge(t.a, t.b, areas);
  add_edge(t.b, t.c, areas);
  add_edge(t.c, t.a, areas);
  return areas;
}

/// Parameter at which a coordinate that runs from `from` to `to` changes sign; 1 if it does not. It
/// always divides, because compilers keep a branch around a division.
template <class T>
LF_HD LF_INLINE T crossing_parameter(const T& from, const T& to) {
  const T none{};
  const T all = none + 1.0;
  const auto crosses = (from < none) != (to < none);
  const T change = from - to;
  const T share = from / (crosses ? change : all);
  return crosses ? share : all;
}

/// ∫ g (1 − s) ds and ∫ g s ds along an edge, g constant in every quadrant.
template <class T>
struct HatWeights {
  T start;
  T end;

  LF_HD LF_INLINE HatWeights(const PlaneVector<T>& a, const PlaneVector<T>& b,
                             const Quadrants<T>& g) {
    const T none{};
    const T sx = crossing_parameter(a.x(), b.x());
    const T sy = crossing_parameter(a.y(), b.y());
    const T s0 = least(sx, sy);
    const T s1 = most(sx, sy);
    const auto right_a = a.x() >= none;
    const auto right_b = b.x() >= none;
    const auto below_a = a.y() >= none;
    const auto below_b = b.y() >= none;
    const T first = g.at(right_a, below_a);
    const T after_x = g.at(right_b, below_a);
    const T after_y = g.at(right_a, below_b);
    const T middle = sx < sy ? after_x : after_y;
    const T last = g.at(right_b, below_b);
    const T whole = first * s0 + middle * (s1 - s0) + last * (1.0 - s1);
    end = 0.5 * (first * s0 * s0 + middle * (s1 - s0) * (s1 + s0) + last * (1.0 - s1) * (1.0 + s1));
    start = whole - end;
  }
};

/// Adds to a_bar and b_bar the derivatives of ∫ g by the ends of the edge a → b.
template <class T>
LF_HD LF_INLINE void add_swept(const PlaneVector<T>& a, const PlaneVector<T>& b,
                               const HatWeights<T>& weights, PlaneVector<T>& a_bar,
                               PlaneVector<T>& b_bar) {
  const PlaneVector<T> normal{b.y() - a.y(), a.x() - b.x()};
  a_bar += weights.start * normal;
  b_bar += weights.end * normal;
}

/// G = ∫ g over a triangle and its derivatives by the corners. g does not change under scaling
/// about the crossing of the pixel borders, so G is homogeneous of degree two and follows from its
/// derivatives by Euler's theorem.
template <class T>
LF_HD LF_INLINE T gather_small(const PlaneTriangle<T>& t, const Quadrants<T>& g,
                               PlaneTriangle<T>& bar) {
  add_swept(t.a, t.b, HatWeights<T>(t.a, t.b, g), bar.a, bar.b);
  add_swept(t.b, t.c, HatWeights<T>(t.b, t.c, g), bar.b, bar.c);
  add_swept(t.c, t.a, HatWeights<T>(t.c, t.a, g), bar.c, bar.a);
  return 0.5 * (t.a.dot(bar.a) + t.b.dot(bar.b) + t.c.dot(bar.c));
}

/// Turns the derivatives of G by the corners into those of E = Φ G / A, which is dE = (G/A) dΦ +
/// (Φ/A)(dG − (G/A) dA); returns ∂E/∂Φ. @param doubled  2 A. @param integral  G.
template <class T>
LF_HD LF_INLINE T mean_adjoint(const PlaneTriangle<T>& t, const T& doubled, const T& flux,
                               const T& integral, PlaneTriangle<T>& bar) {
  const T inverse_area = 2.0 / doubled;
  const T mean = integral * inverse_area;
  const T density = flux * inverse_area;
  const T scale = -0.5 * mean;
  bar.a += scale * PlaneVector<T>{t.b.y() - t.c.y(), t.c.x() - t.b.x()};
  bar.b += scale * PlaneVector<T>{t.c.y() - t.a.y(), t.a.x() - t.c.x()};
  bar.c += scale * PlaneVector<T>{t.a.y() - t.b.y(), t.b.x() - t.a.x()};
  bar = {density * bar.a, density * bar.b, density * bar.c};
  return mean;
}

}  // namespace flux_detail

// The flux that one image triangle gives to every pixel, exactly, and its adjoint.
//
// Notation: t triangle of flux Φ, A its signed area, ρ = Φ/A; g = ∂E/∂(pixel flux), S(c) = Σ of g
// over the columns ≥ c of a row; x̄ mean offset of an edge piece from its column's left side.
//
// With Green's theorem a pixel's covered area is a sum over edge pieces: a piece in column c covers
// −Δy(1 − x̄) of that pixel and −Δy of every pixel to its right. So deposits go into the picture's
// *row differences*: one prefix sum along each row (ResolveFlux) yields the picture, and no polygon
// is ever clipped.

/// Fixed-point unit of the flux picture: 2⁻⁵² of the lens's total flux. A pixel's sum is at most
/// the total, 2⁵², for any number of triangles; intermediate sums are taken modulo 2⁶⁴, so they
/// cannot overflow. Single deposits stay below 2⁶³ because ρ ≤ kMaxDensity.
inline constexpr double kFluxUnits = 4503599627370496.0;

/// Triangles denser than this (total fluxes per square pixel) are treated as needles.
inline constexpr double kMaxDensity = 1024.0;

/// Below this ratio of area to the square of the longest side a triangle is treated as a needle, a
/// line of light. At this ratio the rounding error of the exact formula (2⁻⁵³ over the ratio) and
/// the error of neglecting the width are both about 1e-8 of the triangle's own flux (measured: up
/// to 1.4e-7). A needle that runs along a pixel border gives all its flux to one of the two sides.
inline constexpr double kNeedleRatio = 1e-8;

/// Row differences of a flux picture in units of 1/kFluxUnits; each row has one column more than
/// the picture, for what is cancelled right of the last pixel.
struct FluxAccumulator {
  std::int64_t* units = nullptr;
  int columns = 0;
  int rows = 0;

  /// Adds modulo 2⁶⁴. @pre 0 ≤ column ≤ columns, 0 ≤ row < rows.
  LF_HD void add(int row, int column, std::int64_t amount) const {
    const std::int64_t index = static_cast<std::int64_t>(row) * (columns + 1) + column;
#if defined(__CUDA_ARCH__)
    atomicAdd(reinterpret_cast<unsigned long long*>(units + index),
              static_cast<unsigned long long>(amount));
#else
    units[index] = static_cast<std::int64_t>(static_cast<std::uint64_t>(units[index]) +
                                             static_cast<std::uint64_t>(amount));
#endif
  }

  /// Gives flux to one pixel; ignores pixels outside the picture.
  LF_HD void add_pixel(int row, int column, std::int64_t amount) const {
    if (row < 0 || row >= rows || column < 0 || column >= columns) return;
    add(row, column, amount);
    add(row, column + 1, -amount);
  }
  /// Gives flux to two neighbouring pixels of a row. @pre both lie in the picture.
  LF_HD void add_inside(int row, int column, std::int64_t here, std::int64_t next) const {
    add(row, column, here);
    add(row, column + 1, next - here);
    add(row, column + 2, -next);
  }
};

/// ∂E/∂(pixel flux) and its sums from the right; rows of columns and columns + 1 values.
struct FluxCotangent {
  const double* pixel = nullptr;
  const double* suffix = nullptr;  ///< S(c), c = 0 … columns; S(columns) = 0.
  int columns = 0;
  int rows = 0;

  [[nodiscard]] LF_HD double at(int row, int column) const {
    if (row < 0 || row >= rows || column < 0 || column >= columns) return 0.0;
    return pixel[static_cast<std::int64_t>(row) * columns + column];
  }
  [[nodiscard]] LF_HD double from(int row, int column) const {
    return suffix[static_cast<std::int64_t>(row) * (columns + 1) + column];
  }
};

namespace flux_detail {

LF_HD inline std::int64_t to_units(double flux) {
  return static_cast<std::int64_t>(std::llrint(flux * kFluxUnits));
}

LF_HD inline PlaneTriangle<double> plane_triangle(const ImageTriangle& t,
                                                  const Eigen::Vector2d& crossing) {
  return {t.p0 - crossing, t.p1 - crossing, t.p2 - crossing};
}

/// Deposit of a triangle that touches at most 2 × 2 pixels. Untouched pixels get exactly nothing.
/// No density is used, so a triangle may be arbitrarily small.
LF_HD inline void deposit_small(const ImageTriangle& t, const PixelBox& box,
                                const FluxAccumulator& image) {
  const Quadrants<double> areas = quadrant_areas(plane_triangle(t, box.crossing()));
  const double density = t.flux / areas.sum();
  const std::int64_t above_left = to_units(density * areas.above_left);
  const std::int64_t above_right = to_units(density * areas.above_right);
  const std::int64_t below_left = to_units(density * areas.below_left);
  const std::int64_t below_right = to_units(density * areas.below_right);
  // Without a border in the box everything counts as right of it (below it).
  const int left = box.c1 - 1;
  const int above = box.r1 - 1;
  if (left >= 0 && above >= 0 && box.c1 < image.columns && box.r1 < image.rows) {
    image.add_inside(above, left, above_left, above_right);
    image.add_inside(box.r1, left, below_left, below_right);
    return;
  }
  image.add_pixel(above, left, above_left);
  image.add_pixel(above, box.c1, above_right);
  image.add_pixel(box.r1, left, below_left);
  image.add_pixel(box.r1, box.c1, below_right);
}

/// Row differences of ρ × (covered area) of one edge. Quantised per end point, so the pieces of a
/// closed polygon cancel exactly in every row.
struct DepositEdge {
  double units_per_area;
  FluxAccumulator image;

  LF_HD void operator()(const EdgePiece& e) const {
    const std::int64_t start = std::llrint(units_per_area * (e.y0 - e.row));
    const std::int64_t end = std::llrint(units_per_area * (e.y1 - e.row));
    const std::int64_t whole = start - end;
    if (e.column < 0) {
      image.add(e.row, 0, whole);
      return;
    }
    const double mean_offset = 0.5 * (e.x0 + e.x1) - e.column;
    const std::int64_t next = std::llrint(units_per_area * (e.y0 - e.y1) * mean_offset);
    image.add(e.row, e.column, whole - next);
    image.add(e.row, e.column + 1, next);
  }
};

/// A triangle without width: its flux is on its longest side a → b, with a tent-shaped density
/// whose peak is the projection of the third corner.
struct Needle {
  Eigen::Vector2d a, b;
  double peak = 0.0;  ///< Parameter of the tent's peak on a → b.

  LF_HD explicit Needle(const ImageTriangle& t) : a(t.p0), b(t.p1) {
    Eigen::Vector2d third = t.p2;
    if ((t.p2 - t.p1).squaredNorm() > (b - a).squaredNorm()) {
      a = t.p1;
      b = t.p2;
      third = t.p0;
    }
    if ((t.p0 - t.p2).squaredNorm() > (b - a).squaredNorm()) {
      a = t.p2;
      b = t.p0;
      third = t.p1;
    }
    const double length_squared = (b - a).squaredNorm();
    if (length_squared > 0.0) peak = (third - a).dot(b - a) / length_squared;
    peak = clamped(peak, 0.0, 1.0);
  }
  /// Share of the flux at parameters below s.
  [[nodiscard]] LF_HD double share_below(double s) const {
    if (s < peak) return s * s / peak;
    return peak >= 1.0 ? s * s : 1.0 - (1.0 - s) * (1.0 - s) / (1.0 - peak);
  }
  /// Calls visit(row, column, share) for every pixel the needle crosses.
  template <class Visit>
  LF_HD void walk(int columns, int rows, Visit&& visit) const {
    walk_edge(a, b, columns, rows, [&](const EdgePiece& e) {
      if (e.column >= 0) visit(e.row, e.column, share_below(e.s1) - share_below(e.s0));
    });
  }
};

LF_HD inline bool is_needle(const ImageTriangle& t, double doubled, double extent) {
  const double area = 0.5 * std::fabs(doubled);
  return !(area > kNeedleRatio * extent * extent && std::fabs(t.flux) <= kMaxDensity * area);
}

/// In 2 × 2 pixels no density is used, so only the loss of digits in the area matters.
LF_HD inline bool is_small_needle(double doubled, double extent) {
  return !(0.5 * std::fabs(doubled) > kNeedleRatio * extent * extent);
}

}  // namespace flux_detail

/// Adds the flux of an image triangle to the picture, Φ·A(t ∩ pixel)/A(t) for every pixel (Sun et
/// al., section 3.2). The orientation of the triangle does not matter. Parts outside the picture
/// are lost; a triangle with a NaN or infinite corner gives nothing.
///
/// Error: 2⁻⁵² of the total flux per edge piece from the fixed point, plus rounding of about 1e-16
/// × side²/area of the triangle's own flux; see kNeedleRatio for triangles without area.
/// Measured by FluxTriangle.* in tests/design/flux/flux_triangle_test.cpp.
LF_HD inline void deposit(const ImageTriangle& t, const FluxAccumulator& image) {
  namespace detail = flux_detail;
  const detail::PixelBox box(t);
  if (t.flux == 0.0 || box.misses(t, image.columns, image.rows)) return;
  if (box.within_one_pixel()) {
    image.add_pixel(box.r0, box.c0, detail::to_units(t.flux));
    return;
  }
  const double doubled = doubled_area(t.p0, t.p1, t.p2);
  const bool small = box.within_two_by_two();
  if (small ? detail::is_small_needle(doubled, box.extent())
            : detail::is_needle(t, doubled, box.extent())) {
    detail::Needle(t).walk(image.columns, image.rows, [&](int row, int column, double share) {
      image.add_pixel(row, column, detail::to_units(t.flux * share));
    });
    return;
  }
  if (small) {
    detail::deposit_small(t, box, image);
    return;
  }
  const detail::DepositEdge edge{kFluxUnits * t.flux / (0.5 * doubled), image};
  walk_edge(t.p0, t.p1, image.columns, image.rows, edge);
  walk_edge(t.p1, t.p2, image.columns, image.rows, edge);
  walk_edge(t.p2, t.p0, image.columns, image.rows, edge);
}

namespace flux_detail {

/// Gathers G = ∫_t g and the derivatives of G by an edge's ends. Moving an edge sweeps area along
/// its outward normal, weighted by the hat functions 1 − s and s of its ends.
struct GatherEdge {
  FluxCotangent cotangent;
  double integral = 0.0;  ///< Share of G from the edges so far.
  double weight_p = 0.0;  ///< ∫ g (1 − s) ds along the current edge.
  double weight_q = 0.0;  ///< ∫ g s ds.

  LF_HD void operator()(const EdgePiece& e) {
    if (e.column < 0) {
      integral += (e.y0 - e.y1) * cotangent.from(e.row, 0);
      return;
    }
    const double g = cotangent.at(e.row, e.column);
    const double mean_offset = 0.5 * (e.x0 + e.x1) - e.column;
    integral += (e.y0 - e.y1) * (cotangent.from(e.row, e.column + 1) + (1.0 - mean_offset) * g);
    const double length = e.s1 - e.s0;
    const double part_q = 0.5 * length * (e.s0 + e.s1);
    weight_q += g * part_q;
    weight_p += g * (length - part_q);
  }

  /// Walks p → q and adds ∂G/∂p and ∂G/∂q.
  LF_HD void edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q, PlaneVector<double>& p_bar,
                  PlaneVector<double>& q_bar) {
    weight_p = weight_q = 0.0;
    walk_edge(p, q, cotangent.columns, cotangent.rows, *this);
    const PlaneVector<double> normal{q.y() - p.y(), p.x() - q.x()};
    p_bar += weight_p * normal;
    q_bar += weight_q * normal;
  }
};

/// g in the pixels of a box of at most 2 × 2.
LF_HD inline Quadrants<double> quadrants_of(const PixelBox& box, const FluxCotangent& cotangent) {
  return {cotangent.at(box.r1 - 1, box.c1 - 1), cotangent.at(box.r1 - 1, box.c1),
          cotangent.at(box.r1, box.c1 - 1), cotangent.at(box.r1, box.c1)};
}

/// G and its derivatives by the corners for any triangle.
LF_HD inline double gather_large(const ImageTriangle& t, const FluxCotangent& cotangent,
                                 PlaneTriangle<double>& bar) {
  GatherEdge gather{cotangent};
  gather.edge(t.p0, t.p1, bar.a, bar.b);
  gather.edge(t.p1, t.p2, bar.b, bar.c);
  gather.edge(t.p2, t.p0, bar.c, bar.a);
  return gather.integral;
}

}  // namespace flux_detail

/// Adjoint of deposit(): derivatives of E by the triangle's corners and flux, for ∂E/∂(pixel).
/// A pure gather. Triangles that deposit() treats as needles have no derivative by their corners.
/// Checked against central differences in tests/design/flux/flux_triangle_test.cpp.
LF_HD inline ImageTriangle deposit_adjoint(const ImageTriangle& t, const FluxCotangent& cotangent) {
  namespace detail = flux_detail;
  ImageTriangle bar;
  const detail::PixelBox box(t);
  if (box.misses(t, cotangent.columns, cotangent.rows)) return bar;
  if (box.within_one_pixel()) {
    bar.flux = cotangent.at(box.r0, box.c0);
    return bar;
  }
  const double doubled = doubled_area(t.p0, t.p1, t.p2);
  const bool small = box.within_two_by_two();
  if (small ? detail::is_small_needle(doubled, box.extent())
            : detail::is_needle(t, doubled, box.extent())) {
    detail::Needle(t).walk(
        cotangent.columns, cotangent.rows,
        [&](int row, int column, double share) { bar.flux += share * cotangent.at(row, column); });
    return bar;
  }
  detail::PlaneTriangle<double> bars{{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
  const double integral = small ? detail::gather_small(detail::plane_triangle(t, box.crossing()),
                                                       detail::quadrants_of(box, cotangent), bars)
                                : detail::gather_large(t, cotangent, bars);
  const detail::PlaneTriangle<double> corners{t.p0, t.p1, t.p2};
  bar.flux = detail::mean_adjoint(corners, doubled, t.flux, integral, bars);
  bar.p0 = bars.a;
  bar.p1 = bars.b;
  bar.p2 = bars.c;
  return bar;
}

}  // namespace lensforge
