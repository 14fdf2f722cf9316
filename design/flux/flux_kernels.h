// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"
#include "design/flux/flux_triangle.h"
#include "design/optics/image_triangle.h"

/// What is done for one triangle, or one pixel of a row, of a flux picture; see
/// core/compute/executor.h for who calls it.
namespace lensforge {

/// Image triangles in memory as a source of FluxImageOn::render().
struct StoredTriangles {
  const ImageTriangle* triangles;
  LF_HD ImageTriangle operator()(std::int64_t i) const { return triangles[i]; }
};

/// Deposits triangle i into the picture of its worker.
template <class Source>
struct DepositFlux {
  Source source;
  FluxAccumulator first;  ///< Worker 0's.
  std::int64_t stride;    ///< Units from one worker's picture to the next.

  LF_HD void operator()(std::int64_t i, int worker) const {
    deposit(source(i), {first.units + stride * worker, first.columns, first.rows});
  }
};

/// Hands item i the picture of its worker to deposit into.
template <class Item>
struct DepositItem {
  const Item& item;
  FluxAccumulator first;  ///< Worker 0's.
  std::int64_t stride;    ///< Units from one worker's picture to the next.

  void operator()(std::int64_t i, int worker) const {
    item(i, FluxAccumulator{first.units + stride * worker, first.columns, first.rows});
  }
};

/// Row differences of all workers → flux, along a row from the left.
struct ResolveFlux {
  using Value = std::uint64_t;  ///< Sums on the way are taken modulo 2⁶⁴.

  const std::int64_t* units;
  double* flux;
  int columns;
  std::int64_t stride;
  int workers;

  [[nodiscard]] LF_HD Value item(std::int64_t row, int column) const {
    const std::int64_t* first = units + row * (columns + 1) + column;
    Value sum = 0;
    for (int w = 0; w < workers; ++w) sum += static_cast<Value>(first[stride * w]);
    return sum;
  }
  LF_HD void store(std::int64_t row, int column, Value sum) const {
    flux[row * columns + column] = static_cast<double>(static_cast<std::int64_t>(sum)) / kFluxUnits;
  }
};

/// ∂E/∂(pixel flux) → its sums from the right, S of FluxCotangent; step k is column columns − 1 −
/// k.
struct SumFromRight {
  using Value = double;

  const double* pixel;
  double* suffix;
  int columns;

  [[nodiscard]] LF_HD Value item(std::int64_t row, int step) const {
    return pixel[row * columns + (columns - 1 - step)];
  }
  LF_HD void store(std::int64_t row, int step, Value sum) const {
    double* from_right = suffix + row * (columns + 1) + columns;
    if (step == 0) *from_right = 0.0;
    from_right[-1 - step] = sum;
  }
};

}  // namespace lensforge
