// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_batch.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/compute/lanes.h"

namespace lensforge {
namespace {

using flux_detail::least;
using flux_detail::most;
using flux_detail::PlaneTriangle;
using flux_detail::Quadrants;

/// The triangles of one vector that touch at most 2 × 2 pixels, all of them in the picture.
template <int lanes>
struct SmallBatch {
  using V = typename VectorOf<lanes>::Doubles;
  using Ints = typename VectorOf<lanes>::Ints;
  using Mask = typename VectorOf<lanes>::Longs;

  PlaneTriangle<V> t;
  V flux;
  V doubled;    ///< Area.
  V c1, r1;     ///< Last column and row.
  V x, y;       ///< Crossing of the pixel borders.
  Mask in_one;  ///< Within one pixel.
  Mask usual;   ///< Others are to be computed one by one.

  LF_INLINE SmallBatch(const ImageTriangleOf<V>& image, int columns, int rows)
      : t{image.p0, image.p1, image.p2}, flux(image.flux) {
    const V x0 = least(t.a.x(), least(t.b.x(), t.c.x()));
    const V x1 = most(t.a.x(), most(t.b.x(), t.c.x()));
    const V y0 = least(t.a.y(), least(t.b.y(), t.c.y()));
    const V y1 = most(t.a.y(), most(t.b.y(), t.c.y()));
    const V c0 = cell(x0);
    const V r0 = cell(y0);
    c1 = cell(x1);
    r1 = cell(y1);
    x = c0 < c1 ? c1 : x0;
    y = r0 < r1 ? r1 : y0;
    doubled = (t.b.x() - t.a.x()) * (t.c.y() - t.a.y()) - (t.c.x() - t.a.x()) * (t.b.y() - t.a.y());
    const V half = 0.5 * doubled;
    const V area = half < 0.0 ? -half : half;
    const V width = x1 - x0;
    const V height = y1 - y0;
    const V extent = most(width, height);
    const V sum = ((t.a.x() + t.a.y()) + (t.b.x() + t.b.y())) + (t.c.x() + t.c.y());
    in_one = (c0 == c1) & (r0 == r1);
    usual = (c1 - c0 <= 1.0) & (r1 - r0 <= 1.0) & (c1 >= 1.0) & (r1 >= 1.0) &
            (c1 < static_cast<double>(columns)) & (r1 < static_cast<double>(rows)) & (sum < 1e300) &
            (in_one | (area > kNeedleRatio * extent * extent));
  }

  [[nodiscard]] LF_INLINE PlaneTriangle<V> about_crossing() const {
    return {{t.a.x() - x, t.a.y() - y}, {t.b.x() - x, t.b.y() - y}, {t.c.x() - x, t.c.y() - y}};
  }

 private:
  /// PixelBox::cell()
  [[nodiscard]] LF_INLINE static V cell(const V& value) {
    const V low = V{} - 1e9;
    const V high = V{} + 1e9;
    const V kept = least(most(value, low), high);
    const V truncated = __builtin_convertvector(__builtin_convertvector(kept, Ints), V);
    const V below = truncated - 1.0;
    return kept < truncated ? below : truncated;
  }
};

/// True if a comparison holds in every lane.
template <class Mask>
LF_INLINE bool in_every_lane(const Mask& mask) {
  std::int64_t every = -1;
  for (std::size_t k = 0; k < sizeof(Mask) / sizeof(std::int64_t); ++k) every &= mask[k];
  return every != 0;
}

/// Deposits of a batch before they are added.
struct BatchDeposits {
  alignas(64) double share[4][TriangleBatch::kSize];  ///< By quadrant, in units.
  alignas(64) double column[TriangleBatch::kSize];    ///< The last; −1 for triangles left out.
  alignas(64) double row[TriangleBatch::kSize];
  /// True for a vector whose triangles are each within one pixel, which then have the last share
  /// alone: the usual case where pixels have many triangles.
  bool in_one[TriangleBatch::kSize];
};

template <int lanes>
LF_INLINE void measure_deposits(const TriangleBatch& batch, int count, int columns, int rows,
                                BatchDeposits& deposits) {
  using V = typename VectorOf<lanes>::Doubles;
  for (int i = 0; i < count; i += lanes) {
    const SmallBatch<lanes> small(batch.several<V>(i), columns, rows);
    const V none{};
    store_lanes<V>(small.usual ? small.c1 : none - 1.0, &deposits.column[i]);
    store_lanes<V>(small.r1, &deposits.row[i]);
    const bool in_one = in_every_lane(small.in_one);
    for (int k = 0; k < lanes; ++k) deposits.in_one[i + k] = in_one;
    if (in_one) {
      store_lanes<V>(small.flux * kFluxUnits, &deposits.share[3][i]);
      continue;
    }
    const Quadrants<V> areas = flux_detail::quadrant_areas(small.about_crossing());
    const V density = small.flux / areas.sum();
    const V above_left = density * areas.above_left;
    const V above_right = density * areas.above_right;
    const V below_left = density * areas.below_left;
    const V below_right = density * areas.below_right;
    store_lanes<V>((small.in_one ? none : above_left) * kFluxUnits, &deposits.share[0][i]);
    store_lanes<V>((small.in_one ? none : above_right) * kFluxUnits, &deposits.share[1][i]);
    store_lanes<V>((small.in_one ? none : below_left) * kFluxUnits, &deposits.share[2][i]);
    store_lanes<V>((small.in_one ? small.flux : below_right) * kFluxUnits, &deposits.share[3][i]);
  }
}

template <int lanes>
LF_INLINE void measure_adjoints(const TriangleBatch& batch, int count,
                                const FluxCotangent& cotangent, TriangleBatch& bars,
                                std::int64_t* usual) {
  using V = typename VectorOf<lanes>::Doubles;
  for (int i = 0; i < count; i += lanes) {
    const SmallBatch<lanes> small(batch.several<V>(i), cotangent.columns, cotangent.rows);
    const V one = V{} + 1.0;
    const V column = small.usual ? small.c1 : one;
    const V row = small.usual ? small.r1 : one;
    const double* below[lanes];
    for (int k = 0; k < lanes; ++k) {
      below[k] = cotangent.pixel + static_cast<std::int64_t>(row[k]) * cotangent.columns +
                 static_cast<std::int64_t>(column[k]);
    }
    constexpr auto kLanes = std::make_integer_sequence<int, lanes>();
    const V here = gather_lanes<V>(below, 0, kLanes);
    ImageTriangleOf<V> bar;
    bar.flux = here;
    if (!in_every_lane(small.in_one)) {
      const Quadrants<V> g{gather_lanes<V>(below, -1 - cotangent.columns, kLanes),
                           gather_lanes<V>(below, -cotangent.columns, kLanes),
                           gather_lanes<V>(below, -1, kLanes), here};
      PlaneTriangle<V> by{};
      const V integral = flux_detail::gather_small(small.about_crossing(), g, by);
      const V mean = flux_detail::mean_adjoint(small.t, small.doubled, small.flux, integral, by);
      const V none{};
      bar.p0 = {small.in_one ? none : by.a.x(), small.in_one ? none : by.a.y()};
      bar.p1 = {small.in_one ? none : by.b.x(), small.in_one ? none : by.b.y()};
      bar.p2 = {small.in_one ? none : by.c.x(), small.in_one ? none : by.c.y()};
      bar.flux = small.in_one ? here : mean;
    }
    bars.set_several(i, bar);
    std::memcpy(usual + i, &small.usual, sizeof small.usual);
  }
}

}  // namespace

void deposit_batch(const TriangleBatch& triangles, int count, const FluxAccumulator& image,
                   Lanes lanes) {
  BatchDeposits deposits;
  call_with_lanes(lanes, [&]<int kLanes>() {
    return measure_deposits<kLanes>(triangles, count, image.columns, image.rows, deposits);
  });
  for (int i = 0; i < count; ++i) {
    if (deposits.column[i] < 0.0) {
      deposit(triangles.at(i), image);
      continue;
    }
    const int left = static_cast<int>(deposits.column[i]) - 1;
    const int below = static_cast<int>(deposits.row[i]);
    if (deposits.in_one[i]) {
      const std::int64_t units = std::llrint(deposits.share[3][i]);
      image.add(below, left + 1, units);
      image.add(below, left + 2, -units);
      continue;
    }
    image.add_inside(below - 1, left, std::llrint(deposits.share[0][i]),
                     std::llrint(deposits.share[1][i]));
    image.add_inside(below, left, std::llrint(deposits.share[2][i]),
                     std::llrint(deposits.share[3][i]));
  }
}

void deposit_adjoint_batch(const TriangleBatch& triangles, int count,
                           const FluxCotangent& cotangent, TriangleBatch& bars, Lanes lanes) {
  alignas(64) std::int64_t usual[TriangleBatch::kSize] = {};
  const bool has_two_by_two = cotangent.columns > 1 && cotangent.rows > 1;
  if (has_two_by_two) {
    call_with_lanes(lanes, [&]<int kLanes>() {
      return measure_adjoints<kLanes>(triangles, count, cotangent, bars, usual);
    });
  }
  for (int i = 0; i < count; ++i) {
    if (usual[i] == 0) bars.set(i, deposit_adjoint(triangles.at(i), cotangent));
  }
}

}  // namespace lensforge
