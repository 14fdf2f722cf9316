// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_batch.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

// Kernels for one triangle, or one pixel of a row, of a flux picture; executors run them.

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

/// Triangles i … i + count − 1 of a source. Sources that make several at a time overload it.
template <class Source>
void fill_batch(const Source& source, std::int64_t i, int count, TriangleBatch& batch) {
  for (int k = 0; k < count; ++k) batch.set(k, source(i + k));
}

/// The same on the CPU, several triangles at a time.
template <class Source>
void parallel_for_worker(const Executor& executor, const char* kernel, std::int64_t count,
                         const DepositFlux<Source>& deposit) {
  executor.run(
      kernel, count, kDefaultGrain,
      [](const void* body, std::int64_t begin, std::int64_t end, int worker) {
        const auto& d = *static_cast<const DepositFlux<Source>*>(body);
        const FluxAccumulator image{d.first.units + d.stride * worker, d.first.columns,
                                    d.first.rows};
        TriangleBatch batch;
        for (std::int64_t i = begin; i < end; i += TriangleBatch::kSize) {
          const int size = static_cast<int>(std::min<std::int64_t>(TriangleBatch::kSize, end - i));
          fill_batch(d.source, i, size, batch);
          deposit_batch(batch, size, image);
        }
      },
      &deposit);
}

/// Gives item i its worker's picture to deposit into.
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
  using Value = std::uint64_t;  ///< Intermediate sums are taken modulo 2⁶⁴.

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

/// Adds the deposits of other processes to the first worker's picture of row differences in
/// `units`. Executors of one process have nothing to add; design/mpi/ overloads this.
template <class Exec>
void join_pictures(const Exec& /*executor*/, std::span<std::int64_t> /*units*/,
                   std::size_t /*per_picture*/) {}

/// Collects rows of derivatives that other processes have computed; nothing in one process.
template <class Exec>
void collect_rows(const Exec& /*executor*/, std::span<double> /*pixels*/) {}

/// Adds up image triangles to a picture of flux, to the same bits for any number of threads and any
/// order of triangles. Keeps its buffers, in the memory of the executor, between pictures.
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

  /// Adds triangles as render() does, between begin() and resolve().
  template <class Source>
  void deposit(const Exec& executor, std::int64_t count, const Source& source) {
    parallel_for_worker(executor, "flux deposit", count,
                        DepositFlux<Source>{source, {units_.data(), columns_, rows_}, stride()});
  }

  /// render() for triangles in the executor's memory.
  std::span<const double> render(const Exec& executor, std::span<const ImageTriangle> triangles) {
    return render(executor, static_cast<std::int64_t>(triangles.size()),
                  StoredTriangles{triangles.data()});
  }

  /// Begins a picture that is made of parts: add() them or deposit() them, then resolve().
  void begin(const Exec& executor) {
    const auto workers = static_cast<std::size_t>(executor.concurrency());
    if (units_.size() != units_per_picture() * workers) {
      units_ = Units(units_per_picture() * workers);
    }
    fill_zero(executor, units_);
  }

  /// Calls `item(i, image)` for i = 0 … count − 1, at the same time from several threads; each
  /// deposits any number of triangles into `image`, a FluxAccumulator. CPU only.
  /// @pre begin() was called with an executor of the same concurrency.
  /// @param grain  minimum number of items per task.
  template <class Item>
  void add(const Exec& executor, std::int64_t count, const Item& item,
           std::int64_t grain = kDefaultGrain) {
    parallel_for_worker(executor, "flux deposit", count,
                        DepositItem<Item>{item, {units_.data(), columns_, rows_}, stride()}, grain);
  }

  /// Flux per pixel of everything added, as render() returns it.
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

  /// Derivatives, to be filled in before prepare().
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

/// Spread of light over the picture under an extended source. Light is resolved in parts of pixels,
/// `parts` each way: with whole pixels an optimiser finds light that adds up only in this
/// approximation.
///
/// Notation: q a part and P a pixel, counted in one direction; out(P) = Σ_d w(d) in(parts·P + d −
/// o).
struct SourceKernel {
  int parts = 1;
  int columns = 1;  ///< Columns of the weights.
  int rows = 1;
  int offset_x = 0;  ///< o
  int offset_y = 0;
  std::vector<double> weights{1.0};  ///< w, row by row from the top.

  [[nodiscard]] bool none() const { return weights.size() == 1; }
};

/// Image of the setup's source through the middle of a lens, where its surface is at height z, mm.
/// Every point of the source shifts the picture, by quadratic interpolation between the parts:
/// linear interpolation would add a blur of its own. One kernel serves the whole picture: a
/// paraxial approximation.
SourceKernel source_kernel(const OpticalSetup& setup, double z);

/// Neighbours in a row that one item sums, so that compilers vectorise.
inline constexpr int kBlurStrip = 8;

/// A kernel, and the size of its two pictures: in parts and in whole pixels.
struct BlurView {
  const double* weights;
  std::int64_t parts;
  std::int64_t kernel_columns;
  std::int64_t kernel_rows;
  std::int64_t offset_x;
  std::int64_t offset_y;
  std::int64_t columns;
  std::int64_t rows;

  [[nodiscard]] LF_HD std::int64_t strips() const {
    return (columns + kBlurStrip - 1) / kBlurStrip;
  }
};

/// Adds w times the items begin, begin + step, … of a line to a strip's sums; ignores items beyond
/// its ends.
LF_HD inline void add_to_strip(double w, const double* line, std::int64_t length,
                               std::int64_t begin, std::int64_t step, double* sum) {
  if (begin >= 0 && begin + step * (kBlurStrip - 1) < length) {
    for (int k = 0; k < kBlurStrip; ++k) sum[k] += w * line[begin + step * k];
    return;
  }
  for (int k = 0; k < kBlurStrip; ++k) {
    const std::int64_t at = begin + step * k;
    if (at >= 0 && at < length) sum[k] += w * line[at];
  }
}

/// Parts → pixels, a strip of a row of pixels. Light that leaves the picture is lost; none enters.
struct BlurStrip {
  BlurView blur;
  const double* parts;
  double* pixels;

  LF_HD void operator()(std::int64_t strip) const {
    const std::int64_t row = strip / blur.strips();
    const std::int64_t first = strip % blur.strips() * kBlurStrip;
    const std::int64_t length = blur.parts * blur.columns;
    double sum[kBlurStrip] = {};
    for (std::int64_t j = 0; j < blur.kernel_rows; ++j) {
      const std::int64_t from = blur.parts * row + j - blur.offset_y;
      if (from < 0 || from >= blur.parts * blur.rows) continue;
      for (std::int64_t i = 0; i < blur.kernel_columns; ++i) {
        const double w = blur.weights[j * blur.kernel_columns + i];
        const std::int64_t begin = blur.parts * first + i - blur.offset_x;
        if (w != 0.0) add_to_strip(w, parts + from * length, length, begin, blur.parts, sum);
      }
    }
    for (std::int64_t k = 0; k < kBlurStrip && first + k < blur.columns; ++k) {
      pixels[row * blur.columns + first + k] = sum[k];
    }
  }
};

/// Transpose of BlurStrip, pixels → parts. A strip has every parts-th part of a row, which all have
/// the same weights.
struct BlurStripAdjoint {
  BlurView blur;
  const double* pixels_bar;
  double* parts_bar;

  [[nodiscard]] LF_HD std::int64_t count() const {
    return blur.parts * blur.rows * blur.parts * blur.strips();
  }
  LF_HD void operator()(std::int64_t item) const {
    const std::int64_t first = item % blur.strips() * kBlurStrip;
    const std::int64_t phase = item / blur.strips() % blur.parts;
    const std::int64_t row = item / blur.strips() / blur.parts;
    double sum[kBlurStrip] = {};
    for (std::int64_t j = (row + blur.offset_y) % blur.parts; j < blur.kernel_rows;
         j += blur.parts) {
      const std::int64_t to = (row + blur.offset_y - j) / blur.parts;
      if (row + blur.offset_y < j || to >= blur.rows) continue;
      add_row(first, phase, j, pixels_bar + to * blur.columns, sum);
    }
    for (std::int64_t k = 0; k < kBlurStrip && first + k < blur.columns; ++k) {
      const std::int64_t column = blur.parts * (first + k) + phase;
      parts_bar[row * blur.parts * blur.columns + column] = sum[k];
    }
  }

 private:
  LF_HD void add_row(std::int64_t first, std::int64_t phase, std::int64_t j, const double* line,
                     double* sum) const {
    for (std::int64_t i = (phase + blur.offset_x) % blur.parts; i < blur.kernel_columns;
         i += blur.parts) {
      const double w = blur.weights[j * blur.kernel_columns + i];
      const std::int64_t begin = first + (phase + blur.offset_x - i) / blur.parts;
      if (w != 0.0) add_to_strip(w, line, blur.columns, begin, 1, sum);
    }
  }
};

/// Blurs pictures of one size in the memory of an executor. Same bits for any number of threads:
/// every sum has a fixed order.
template <class Exec>
class SourceBlurOn {
 public:
  SourceBlurOn(SourceKernel kernel, int columns, int rows, const Exec& executor)
      : kernel_(std::move(kernel)),
        columns_(columns),
        rows_(rows),
        weights_(buffer_of(executor, std::span<const double>(kernel_.weights))),
        pixels_(kernel_.none()
                    ? 0
                    : static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
        bar_(pixels_.size()) {}

  /// True if the source has no extent.
  [[nodiscard]] bool none() const { return kernel_.none(); }
  [[nodiscard]] int parts() const { return kernel_.parts; }

  /// Blurs a picture in parts to one in pixels; the result is valid until the next call.
  std::span<const double> apply(const Exec& executor, std::span<const double> parts) {
    if (none()) return parts;
    const BlurStrip blur{view(), parts.data(), pixels_.data()};
    parallel_for(executor, "source blur", blur.blur.strips() * rows_, blur, kStripGrain);
    return {pixels_.data(), pixels_.size()};
  }
  /// Derivatives by the pixels, to be filled in before apply_adjoint(). @pre !none().
  [[nodiscard]] std::span<double> bar() { return {bar_.data(), bar_.size()}; }
  /// Transpose of apply(), applied to bar().
  void apply_adjoint(const Exec& executor, std::span<double> parts_bar) {
    if (none()) return;
    const BlurStripAdjoint blur{view(), bar_.data(), parts_bar.data()};
    parallel_for(executor, "source blur adjoint", blur.count(), blur, kStripGrain);
  }

 private:
  /// Minimum number of strips per task.
  static constexpr std::int64_t kStripGrain = 16;

  [[nodiscard]] BlurView view() const {
    return {weights_.data(),  kernel_.parts,    kernel_.columns, kernel_.rows,
            kernel_.offset_x, kernel_.offset_y, columns_,        rows_};
  }

  SourceKernel kernel_;
  int columns_;
  int rows_;
  typename Exec::template Buffer<double> weights_;
  typename Exec::template Buffer<double> pixels_;
  typename Exec::template Buffer<double> bar_;
};

}  // namespace lensforge
