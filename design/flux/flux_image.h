// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/executor.h"
#include "design/flux/flux_triangle.h"
#include "design/optics/image_triangle.h"

namespace lensforge {

/// Adds up image triangles into a picture of flux, bit-identically for any number of threads and
/// any order of triangles. Keeps its buffers between pictures.
class FluxImage {
 public:
  /// @pre columns, rows ≥ 1.
  FluxImage(int columns, int rows);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }

  /// Renders `count` triangles, `source(i)` for i = 0 … count − 1 (called at the same time from
  /// several threads), and returns the flux of every pixel as a share of the lens's total, row by
  /// row from the top. The values stay valid until the next call. Work: pixels crossed by edges.
  template <class Source>
  std::span<const double> render(const Executor& executor, std::int64_t count,
                                 const Source& source) {
    clear(executor);
    const auto work = [&](std::int64_t begin, std::int64_t end, int worker) {
      const FluxAccumulator image = accumulator(worker);
      for (std::int64_t i = begin; i < end; ++i) deposit(source(i), image);
    };
    executor.run(
        "flux deposit", count, kDefaultGrain,
        [](const void* body, std::int64_t begin, std::int64_t end, int worker) {
          (*static_cast<const decltype(work)*>(body))(begin, end, worker);
        },
        &work);
    return resolve(executor);
  }

  /// render() of triangles in memory.
  std::span<const double> render(const Executor& executor,
                                 std::span<const ImageTriangle> triangles) {
    return render(executor, static_cast<std::int64_t>(triangles.size()),
                  [triangles](std::int64_t i) { return triangles[static_cast<std::size_t>(i)]; });
  }

 private:
  [[nodiscard]] FluxAccumulator accumulator(int worker);
  void clear(const Executor& executor);
  std::span<const double> resolve(const Executor& executor);

  int columns_;
  int rows_;
  std::vector<std::vector<std::int64_t>> units_;  ///< One picture of row differences per worker.
  std::vector<double> flux_;
};

/// ∂E/∂(pixel flux) prepared for deposit_adjoint().
class FluxCotangentImage {
 public:
  /// Takes columns × rows derivatives, row by row from the top.
  FluxCotangentImage(int columns, int rows);

  /// Derivatives to be filled in; call prepare() afterwards.
  [[nodiscard]] std::span<double> pixels() { return pixel_; }
  /// Sums the rows from the right.
  void prepare(const Executor& executor);
  [[nodiscard]] FluxCotangent view() const {
    return {pixel_.data(), suffix_.data(), columns_, rows_};
  }

 private:
  int columns_;
  int rows_;
  std::vector<double> pixel_;
  std::vector<double> suffix_;
};

}  // namespace lensforge
