// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/lanes.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// Image triangles, or derivatives by them, number by number, so that an instruction of the
/// processor works on several of them at a time.
class TriangleBatch {
 public:
  static constexpr int kSize = 64;

  void set(int i, const ImageTriangle& t) {
    x_[0][i] = t.p0.x();
    y_[0][i] = t.p0.y();
    x_[1][i] = t.p1.x();
    y_[1][i] = t.p1.y();
    x_[2][i] = t.p2.x();
    y_[2][i] = t.p2.y();
    flux_[i] = t.flux;
  }
  [[nodiscard]] ImageTriangle at(int i) const {
    return {{x_[0][i], y_[0][i]}, {x_[1][i], y_[1][i]}, {x_[2][i], y_[2][i]}, flux_[i]};
  }

  /// Triangles i and following, as many as a vector has lanes.
  template <class V>
  [[nodiscard]] LF_INLINE ImageTriangleOf<V> several(int i) const {
    return {{load_lanes<V>(x(0, i)), load_lanes<V>(y(0, i))},
            {load_lanes<V>(x(1, i)), load_lanes<V>(y(1, i))},
            {load_lanes<V>(x(2, i)), load_lanes<V>(y(2, i))},
            load_lanes<V>(flux(i))};
  }
  template <class V>
  LF_INLINE void set_several(int i, const ImageTriangleOf<V>& t) {
    store_lanes<V>(t.p0.x(), x(0, i));
    store_lanes<V>(t.p0.y(), y(0, i));
    store_lanes<V>(t.p1.x(), x(1, i));
    store_lanes<V>(t.p1.y(), y(1, i));
    store_lanes<V>(t.p2.x(), x(2, i));
    store_lanes<V>(t.p2.y(), y(2, i));
    store_lanes<V>(t.flux, flux(i));
  }

 private:
  // Numbers of triangles i and following.
  [[nodiscard]] double* x(int corner, int i) { return &x_[corner][i]; }
  [[nodiscard]] double* y(int corner, int i) { return &y_[corner][i]; }
  [[nodiscard]] double* flux(int i) { return &flux_[i]; }
  [[nodiscard]] const double* x(int corner, int i) const { return &x_[corner][i]; }
  [[nodiscard]] const double* y(int corner, int i) const { return &y_[corner][i]; }
  [[nodiscard]] const double* flux(int i) const { return &flux_[i]; }

  alignas(64) double x_[3][kSize] = {};
  alignas(64) double y_[3][kSize] = {};
  alignas(64) double flux_[kSize] = {};
};

/// deposit() of the first `count` triangles, with the same bits. Most of them should touch at most
/// 2 × 2 pixels: these are computed several at a time, the others one by one.
/// @param lanes  @pre at most widest_lanes().
void deposit_batch(const TriangleBatch& triangles, int count, const FluxAccumulator& image,
                   Lanes lanes = widest_lanes());

/// deposit_adjoint() of the first `count` triangles, with the same bits.
void deposit_adjoint_batch(const TriangleBatch& triangles, int count,
                           const FluxCotangent& cotangent, TriangleBatch& bars,
                           Lanes lanes = widest_lanes());

}  // namespace lensforge
