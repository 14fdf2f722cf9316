// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// What an extended source makes of one lit pixel: weights around it, row by row from the top, that
/// sum to 1.
struct BlurKernel {
  int reach_x = 0;  ///< Pixels on either side.
  int reach_y = 0;
  std::vector<double> weights{1.0};

  [[nodiscard]] int columns() const { return 2 * reach_x + 1; }
  [[nodiscard]] bool none() const { return weights.size() == 1; }
};

/// The image of the setup's source through the middle of a lens whose surface there is at height z,
/// mm. Every part of the source shifts the picture; light counts as even within a pixel, so that a
/// shift divides it between four. The same kernel serves the whole picture, a paraxial
/// approximation.
BlurKernel source_kernel(const OpticalSetup& setup, double z);

/// A picture under the kernel. Light that leaves it is lost, and none comes in.
Image blurred(const Image& picture, const BlurKernel& kernel, const Executor& executor);

/// Neighbouring pixels of a row that one item sums, so that a compiler takes them side by side.
inline constexpr int kBlurStrip = 8;

/// out(p) = Σ_k w(k) in(p − k) for a strip of a row, with sign 1, or in(p + k) with sign −1: the
/// transpose.
struct BlurStrip {
  const double* in;
  double* out;
  const double* weights;
  std::int64_t columns;
  std::int64_t rows;
  std::int64_t reach_x;
  std::int64_t reach_y;
  std::int64_t sign;

  [[nodiscard]] LF_HD std::int64_t strips() const {
    return (columns + kBlurStrip - 1) / kBlurStrip;
  }
  LF_HD void operator()(std::int64_t strip) const {
    const std::int64_t row = strip / strips();
    const std::int64_t first = strip % strips() * kBlurStrip;
    double sum[kBlurStrip] = {};
    for (std::int64_t j = -reach_y; j <= reach_y; ++j) {
      const std::int64_t from = row - sign * j;
      if (from < 0 || from >= rows) continue;
      for (std::int64_t i = -reach_x; i <= reach_x; ++i) {
        const double w = weights[(j + reach_y) * (2 * reach_x + 1) + i + reach_x];
        if (w != 0.0) add(in + from * columns, first - sign * i, w, sum);
      }
    }
    for (std::int64_t k = 0; k < kBlurStrip && first + k < columns; ++k) {
      out[row * columns + first + k] = sum[k];
    }
  }

 private:
  /// Adds w times the pixels of a row from `begin` on.
  LF_HD void add(const double* line, std::int64_t begin, double w, double* sum) const {
    if (begin >= 0 && begin + kBlurStrip <= columns) {
      for (int k = 0; k < kBlurStrip; ++k) sum[k] += w * line[begin + k];
      return;
    }
    for (int k = 0; k < kBlurStrip; ++k) {
      if (begin + k >= 0 && begin + k < columns) sum[k] += w * line[begin + k];
    }
  }
};

/// The kernel at work on pictures of one size in the memory of an executor. Same bits for any
/// number of threads: every pixel is summed in one order.
template <class Exec>
class SourceBlurOn {
 public:
  SourceBlurOn(const BlurKernel& kernel, int columns, int rows, const Exec& executor)
      : columns_(columns),
        rows_(rows),
        reach_x_(kernel.reach_x),
        reach_y_(kernel.reach_y),
        weights_(buffer_of(executor, std::span<const double>(kernel.weights))),
        picture_(kernel.none() ? 0 : static_cast<std::size_t>(columns) * rows) {}

  /// True if there is nothing to do.
  [[nodiscard]] bool none() const { return picture_.size() == 0; }

  /// The picture blurred, in memory of the blur's own; valid until the next call.
  std::span<const double> apply(const Exec& executor, std::span<const double> picture) {
    if (none()) return picture;
    run(executor, "source blur", picture.data(), picture_.data(), 1);
    return {picture_.data(), picture_.size()};
  }
  /// Transpose of apply(), in place.
  void apply_adjoint(const Exec& executor, std::span<double> bar) {
    if (none()) return;
    run(executor, "source blur adjoint", bar.data(), picture_.data(), -1);
    parallel_for(executor, "copy", static_cast<std::int64_t>(bar.size()),
                 CopyPixel{picture_.data(), bar.data()});
  }

 private:
  struct CopyPixel {
    const double* from;
    double* to;
    LF_HD void operator()(std::int64_t i) const { to[i] = from[i]; }
  };

  /// Strips that one task sums at least.
  static constexpr std::int64_t kStripGrain = 16;

  void run(const Exec& executor, const char* name, const double* in, double* out, int sign) {
    const BlurStrip blur{in, out, weights_.data(), columns_, rows_, reach_x_, reach_y_, sign};
    parallel_for(executor, name, blur.strips() * rows_, blur, kStripGrain);
  }

  int columns_;
  int rows_;
  int reach_x_;
  int reach_y_;
  typename Exec::template Buffer<double> weights_;
  typename Exec::template Buffer<double> picture_;
};

}  // namespace lensforge
