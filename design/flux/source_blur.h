// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// How an extended source spreads light over the picture. Light is told apart in parts of pixels,
/// `parts` each way: in whole ones an optimiser finds light that only seems to add up.
///
/// Notation: q a part and P a pixel, counted in one direction; out(P) = Σ_d w(d) in(parts·P + d −
/// o).
struct SourceKernel {
  int parts = 1;
  int columns = 1;  ///< Of the weights.
  int rows = 1;
  int offset_x = 0;  ///< o
  int offset_y = 0;
  std::vector<double> weights{1.0};  ///< w, row by row from the top.

  [[nodiscard]] bool none() const { return weights.size() == 1; }
};

/// The image of the setup's source through the middle of a lens whose surface there is at height z,
/// mm. Every point of the source shifts the picture, by quadratic interpolation between the parts:
/// linear interpolation would add a blur of its own. One kernel serves the whole picture: a
/// paraxial approximation.
SourceKernel source_kernel(const OpticalSetup& setup, double z);

/// Neighbours in a row that one item sums, so that a compiler takes them side by side.
inline constexpr int kBlurStrip = 8;

/// A kernel and two pictures of so many pixels: in parts and in whole ones.
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

/// Adds w times the items begin, begin + step, … of a line to a strip's sums; none beyond its ends.
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

/// Parts → pixels, a strip of a row of pixels. Light that leaves the picture is lost, none comes
/// in.
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

/// Its transpose, pixels → parts: of a row of parts every parts-th one, which all have the same
/// weights.
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

/// A kernel at work on pictures of one size in the memory of an executor. Same bits for any number
/// of threads: every sum has one order.
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

  /// True if there is nothing to do.
  [[nodiscard]] bool none() const { return kernel_.none(); }
  [[nodiscard]] int parts() const { return kernel_.parts; }

  /// A picture in parts → the one that is seen, in pixels; valid until the next call.
  std::span<const double> apply(const Exec& executor, std::span<const double> parts) {
    if (none()) return parts;
    const BlurStrip blur{view(), parts.data(), pixels_.data()};
    parallel_for(executor, "source blur", blur.blur.strips() * rows_, blur, kStripGrain);
    return {pixels_.data(), pixels_.size()};
  }
  /// Derivatives by the pixels, to be filled in before apply_adjoint(). @pre !none().
  [[nodiscard]] std::span<double> bar() { return {bar_.data(), bar_.size()}; }
  /// Transpose of apply(), of bar().
  void apply_adjoint(const Exec& executor, std::span<double> parts_bar) {
    if (none()) return;
    const BlurStripAdjoint blur{view(), bar_.data(), parts_bar.data()};
    parallel_for(executor, "source blur adjoint", blur.count(), blur, kStripGrain);
  }

 private:
  /// Strips that one task sums at least.
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
