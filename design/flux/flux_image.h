// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/compute/executor.h"
#include "design/flux/flux_kernels.h"
#include "design/flux/flux_triangle.h"
#include "design/optics/image_triangle.h"

namespace lensforge {

/// Adds what other processes have deposited to a picture of row differences, the first of the
/// workers' in `units`. Executors of one process have nothing to add; design/mpi/ has the other
/// one.
template <class Exec>
void join_pictures(const Exec& /*executor*/, std::span<std::int64_t> /*units*/,
                   std::size_t /*per_picture*/) {}

/// Gets the derivatives that other processes have found, of which this one has some rows; nothing
/// in one process.
template <class Exec>
void collect_rows(const Exec& /*executor*/, std::span<double> /*pixels*/) {}

/// Adds up image triangles into a picture of flux, bit-identically for any number of threads and
/// any order of triangles. Keeps its buffers, in the memory of the executor, between pictures.
template <class Exec>
class FluxImageOn {
 public:
  /// @pre columns, rows ≥ 1.
  FluxImageOn(int columns, int rows)
      : columns_(columns),
        rows_(rows),
        flux_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }

  /// Renders `count` triangles, `source(i)` for i = 0 … count − 1 (called at the same time from
  /// several threads), and returns the flux of every pixel as a share of the lens's total, row by
  /// row from the top. The values stay valid until the next call. Work: pixels crossed by edges.
  template <class Source>
  std::span<const double> render(const Exec& executor, std::int64_t count, const Source& source) {
    begin(executor);
    deposit(executor, count, source);
    return resolve(executor);
  }

  /// Adds triangles as of render() between begin() and resolve().
  template <class Source>
  void deposit(const Exec& executor, std::int64_t count, const Source& source) {
    parallel_for_worker(executor, "flux deposit", count,
                        DepositFlux<Source>{source, {units_.data(), columns_, rows_}, stride()});
  }

  /// render() of triangles in the executor's memory.
  std::span<const double> render(const Exec& executor, std::span<const ImageTriangle> triangles) {
    return render(executor, static_cast<std::int64_t>(triangles.size()),
                  StoredTriangles{triangles.data()});
  }

  /// Begins a picture that is made of parts: add() them, then resolve().
  void begin(const Exec& executor) {
    const auto workers = static_cast<std::size_t>(executor.concurrency());
    if (units_.size() != units_per_picture() * workers) {
      units_ = Units(units_per_picture() * workers);
    }
    fill_zero(executor, units_);
  }

  /// Calls `item(i, image)` for i = 0 … count − 1, at the same time from several threads; each
  /// deposits as many triangles as it likes into `image`, a FluxAccumulator. CPU only.
  /// @pre begin() was called with an executor of the same concurrency.
  /// @param grain  items that one task handles at least.
  template <class Item>
  void add(const Exec& executor, std::int64_t count, const Item& item,
           std::int64_t grain = kDefaultGrain) {
    parallel_for_worker(executor, "flux deposit", count,
                        DepositItem<Item>{item, {units_.data(), columns_, rows_}, stride()}, grain);
  }

  /// The flux of every pixel of all that was added, as render() returns it.
  std::span<const double> resolve(const Exec& executor) {
    join_pictures(executor, std::span(units_.data(), units_.size()), units_per_picture());
    scan_rows(executor, "flux resolve", rows_, columns_,
              ResolveFlux{units_.data(), flux_.data(), columns_, stride(), executor.concurrency()});
    return {flux_.data(), flux_.size()};
  }

 private:
  using Units = typename Exec::template Buffer<std::int64_t>;

  [[nodiscard]] std::size_t units_per_picture() const {
    return (static_cast<std::size_t>(columns_) + 1) * static_cast<std::size_t>(rows_);
  }

  [[nodiscard]] std::int64_t stride() const {
    return static_cast<std::int64_t>(units_per_picture());
  }

  int columns_;
  int rows_;
  Units units_;  ///< One picture of row differences per worker.
  typename Exec::template Buffer<double> flux_;
};

using FluxImage = FluxImageOn<Executor>;

/// ∂E/∂(pixel flux) prepared for deposit_adjoint().
template <class Exec>
class FluxCotangentImageOn {
 public:
  /// Takes columns × rows derivatives, row by row from the top.
  FluxCotangentImageOn(int columns, int rows)
      : columns_(columns),
        rows_(rows),
        pixel_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
        suffix_((static_cast<std::size_t>(columns) + 1) * static_cast<std::size_t>(rows)) {}

  /// Derivatives to be filled in; call prepare() afterwards.
  [[nodiscard]] std::span<double> pixels() { return {pixel_.data(), pixel_.size()}; }
  /// Sums the rows from the right.
  void prepare(const Exec& executor) {
    collect_rows(executor, pixels());
    scan_rows(executor, "flux cotangent", rows_, columns_,
              SumFromRight{pixel_.data(), suffix_.data(), columns_});
  }
  [[nodiscard]] FluxCotangent view() const {
    return {pixel_.data(), suffix_.data(), columns_, rows_};
  }

 private:
  int columns_;
  int rows_;
  typename Exec::template Buffer<double> pixel_;
  typename Exec::template Buffer<double> suffix_;
};

using FluxCotangentImage = FluxCotangentImageOn<Executor>;

extern template class FluxImageOn<Executor>;
extern template class FluxCotangentImageOn<Executor>;

}  // namespace lensforge
