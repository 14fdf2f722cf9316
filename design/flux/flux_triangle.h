// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/flux/edge_walk.h"
#include "design/flux/quadrants.h"
#include "design/optics/image_triangle.h"

/// The flux that one image triangle gives to every pixel, exactly, and its adjoint.
///
/// Notation: t triangle of flux Φ, A its signed area, ρ = Φ/A; g = ∂E/∂(pixel flux), S(c) = Σ of g
/// over the columns ≥ c of a row; x̄ mean offset of an edge piece from its column's left side.
///
/// With Green's theorem a pixel's covered area is a sum over edge pieces: a piece in column c
/// covers −Δy(1 − x̄) of that pixel and −Δy of every pixel to its right. Deposits are therefore made
/// into the picture's *row differences*: one prefix sum along each row (flux_image.cpp) yields the
/// picture, and no polygon is ever clipped.
namespace lensforge {

/// Fixed-point unit of the flux picture: 2⁻⁵² of the lens's total flux. A pixel's sum is at most
/// the total, 2⁵², whatever the number of triangles; sums on the way are taken modulo 2⁶⁴, so they
/// cannot overflow. Single deposits stay below 2⁶³ because ρ ≤ kMaxDensity.
inline constexpr double kFluxUnits = 4503599627370496.0;

/// Triangles denser than this (total fluxes per square pixel) are treated as needles.
inline constexpr double kMaxDensity = 1024.0;

/// Below this ratio of area to the square of the longest side a triangle is treated as a needle, a
/// line of light. There the rounding error of the exact formula (2⁻⁵³ over the ratio) and the error
/// of neglecting the width are both about 1e-8, measured up to 1.4e-7, of the triangle's own flux;
/// only a needle that runs along a pixel border gives all of it to one of the two sides.
inline constexpr double kNeedleRatio = 1e-8;

/// Row differences of a flux picture in units of 1/kFluxUnits; each row has one column more than
/// the picture, which takes what is cancelled right of the last pixel.
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

  /// Gives flux to one pixel; nothing happens outside the picture.
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

/// Deposit of a triangle that touches at most 2 × 2 pixels. Untouched pixels get exactly nothing,
/// and no density enters, so that a triangle may be as small as it likes.
LF_HD inline void deposit_small(const ImageTriangle& t, const PixelBox& box,
                                const FluxAccumulator& image) {
  const Quadrants areas = quadrant_areas(t, box.crossing());
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

/// Row differences of ρ × (covered area) of one edge. Quantised per end point, so that the pieces
/// of a closed polygon cancel exactly in every row.
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

/// A triangle without width: its flux lies on its longest side a → b with the density of a tent
/// whose peak is where the third corner projects to.
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

/// In 2 × 2 pixels no density enters, so only the loss of digits in the area counts.
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
  double integral = 0.0;  ///< Share of G of the edges so far.
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
  LF_HD void edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q, Eigen::Vector2d& p_bar,
                  Eigen::Vector2d& q_bar) {
    weight_p = weight_q = 0.0;
    walk_edge(p, q, cotangent.columns, cotangent.rows, *this);
    const Eigen::Vector2d normal(q.y() - p.y(), p.x() - q.x());
    p_bar += weight_p * normal;
    q_bar += weight_q * normal;
  }
};

/// Adds to p_bar and q_bar the derivatives of G by the ends of the edge p → q.
LF_HD inline void add_swept(const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                            const HatWeights& weights, Eigen::Vector2d& p_bar,
                            Eigen::Vector2d& q_bar) {
  const Eigen::Vector2d normal(q.y() - p.y(), p.x() - q.x());
  p_bar += weights.start * normal;
  q_bar += weights.end * normal;
}

/// G and its derivatives by the corners for a triangle within 2 × 2 pixels. Seen from where the
/// pixel borders cross, g does not change under scaling, so G is homogeneous of degree two and
/// follows from its derivatives by Euler's theorem.
LF_HD inline double gather_small(const ImageTriangle& t, const PixelBox& box,
                                 const FluxCotangent& cotangent, ImageTriangle& bar) {
  const Eigen::Vector2d crossing = box.crossing();
  const Quadrants g{cotangent.at(box.r1 - 1, box.c1 - 1), cotangent.at(box.r1 - 1, box.c1),
                    cotangent.at(box.r1, box.c1 - 1), cotangent.at(box.r1, box.c1)};
  const Eigen::Vector2d a = t.p0 - crossing;
  const Eigen::Vector2d b = t.p1 - crossing;
  const Eigen::Vector2d c = t.p2 - crossing;
  add_swept(a, b, HatWeights(a, b, g), bar.p0, bar.p1);
  add_swept(b, c, HatWeights(b, c, g), bar.p1, bar.p2);
  add_swept(c, a, HatWeights(c, a, g), bar.p2, bar.p0);
  return 0.5 * (a.dot(bar.p0) + b.dot(bar.p1) + c.dot(bar.p2));
}

/// G and its derivatives by the corners for any triangle.
LF_HD inline double gather_large(const ImageTriangle& t, const FluxCotangent& cotangent,
                                 ImageTriangle& bar) {
  GatherEdge gather{cotangent};
  gather.edge(t.p0, t.p1, bar.p0, bar.p1);
  gather.edge(t.p1, t.p2, bar.p1, bar.p2);
  gather.edge(t.p2, t.p0, bar.p2, bar.p0);
  return gather.integral;
}

/// Adds scale × ∂(doubled signed area)/∂corners.
LF_HD inline void doubled_area_adjoint(const ImageTriangle& t, double scale, ImageTriangle& bar) {
  bar.p0 += scale * Eigen::Vector2d(t.p1.y() - t.p2.y(), t.p2.x() - t.p1.x());
  bar.p1 += scale * Eigen::Vector2d(t.p2.y() - t.p0.y(), t.p0.x() - t.p2.x());
  bar.p2 += scale * Eigen::Vector2d(t.p0.y() - t.p1.y(), t.p1.x() - t.p0.x());
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
  const double integral = small ? detail::gather_small(t, box, cotangent, bar)
                                : detail::gather_large(t, cotangent, bar);
  // E = Φ G / A, so dE = (G/A) dΦ + (Φ/A)(dG − (G/A) dA).
  const double inverse_area = 2.0 / doubled;
  const double mean = integral * inverse_area;
  const double density = t.flux * inverse_area;
  detail::doubled_area_adjoint(t, -0.5 * mean, bar);
  bar.p0 *= density;
  bar.p1 *= density;
  bar.p2 *= density;
  bar.flux = mean;
  return bar;
}

}  // namespace lensforge
