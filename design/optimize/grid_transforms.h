// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>

#include "core/compute/executor.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

/// Three cosine transforms of one size, one per coordinate, in the memory of an executor. Every
/// executor has its own: FFTW on the CPU, cuFFT on a GPU.
template <class Exec>
class GridTransforms;

template <>
class GridTransforms<Executor> {
 public:
  /// @pre columns, rows ≥ 2.
  GridTransforms(int columns, int rows, const Executor& executor)
      : executor_(executor),
        transforms_{CosineTransform(columns, rows), CosineTransform(columns, rows),
                    CosineTransform(columns, rows)} {}

  /// Values of coordinate k, row by row.
  [[nodiscard]] double* plane(int k) {
    return transforms_[static_cast<std::size_t>(k)].values().data();
  }
  /// Transforms all three planes in place.
  void run() {
    parallel_for(
        executor_, "cosine transform", 3,
        [this](std::int64_t k) { transforms_[static_cast<std::size_t>(k)].run(); }, 1);
  }

 private:
  Executor executor_;
  std::array<CosineTransform, 3> transforms_;
};

}  // namespace lensforge
