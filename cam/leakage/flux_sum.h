// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/executor.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// A picture of flux that image triangles are added to in as many parts as one likes, each item
/// with as many triangles as it likes; FluxImage takes them all at once. Same bits for any order,
/// any parts and any number of threads, since sums are in fixed point (flux_triangle.h).
class FluxSum {
 public:
  /// @pre columns, rows ≥ 1; add() is called with executors of at most this concurrency.
  FluxSum(int columns, int rows, const Executor& executor);

  /// Calls `item(i, image)` for i = 0 … count − 1, at the same time from several threads; each
  /// deposits into `image`.
  template <class Item>
  void add(const Executor& executor, std::int64_t count, const Item& item) {
    const auto work = [&](std::int64_t first, std::int64_t last, int worker) {
      const FluxAccumulator image{units_[static_cast<std::size_t>(worker)].data(), columns_, rows_};
      for (std::int64_t i = first; i < last; ++i) item(i, image);
    };
    executor.run(
        "flux deposit", count, kDefaultGrain,
        [](const void* body, std::int64_t first, std::int64_t last, int worker) {
          (*static_cast<const decltype(work)*>(body))(first, last, worker);
        },
        &work);
  }

  /// Flux of every pixel of all that was added, as a share of the lens's total, row by row from the
  /// top.
  [[nodiscard]] std::vector<double> flux() const;

 private:
  int columns_;
  int rows_;
  std::vector<std::vector<std::int64_t>> units_;  ///< Row differences, one picture per worker.
};

}  // namespace lensforge
