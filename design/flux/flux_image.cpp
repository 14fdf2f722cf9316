// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/flux/flux_image.h"

#include <algorithm>
#include <cstddef>

namespace lensforge {

namespace {

std::size_t pixel_count(int columns, int rows) {
  return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
}

/// Rows that one task handles at least.
constexpr std::int64_t kRowGrain = 16;

}  // namespace

FluxImage::FluxImage(int columns, int rows)
    : columns_(columns), rows_(rows), flux_(pixel_count(columns, rows)) {}

FluxAccumulator FluxImage::accumulator(int worker) {
  return {units_[static_cast<std::size_t>(worker)].data(), columns_, rows_};
}

void FluxImage::clear(const Executor& executor) {
  units_.resize(static_cast<std::size_t>(executor.concurrency()));
  for (auto& units : units_) units.assign(pixel_count(columns_ + 1, rows_), 0);
}

std::span<const double> FluxImage::resolve(const Executor& executor) {
  const std::size_t stride = static_cast<std::size_t>(columns_) + 1;
  const auto resolve_row = [&](std::int64_t r) {
    const std::size_t row = static_cast<std::size_t>(r);
    double* flux = flux_.data() + row * static_cast<std::size_t>(columns_);
    std::uint64_t running = 0;
    for (std::size_t c = 0; c + 1 < stride; ++c) {
      for (const auto& units : units_) {
        running += static_cast<std::uint64_t>(units[row * stride + c]);
      }
      flux[c] = static_cast<double>(static_cast<std::int64_t>(running)) / kFluxUnits;
    }
  };
  parallel_for(executor, "flux resolve", rows_, resolve_row, kRowGrain);
  return flux_;
}

FluxCotangentImage::FluxCotangentImage(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      pixel_(pixel_count(columns, rows)),
      suffix_(pixel_count(columns + 1, rows)) {}

void FluxCotangentImage::prepare(const Executor& executor) {
  const auto sum_row = [&](std::int64_t r) {
    const std::size_t columns = static_cast<std::size_t>(columns_);
    const double* pixel = pixel_.data() + static_cast<std::size_t>(r) * columns;
    double* suffix = suffix_.data() + static_cast<std::size_t>(r) * (columns + 1);
    suffix[columns] = 0.0;
    for (std::size_t c = columns; c-- > 0;) suffix[c] = suffix[c + 1] + pixel[c];
  };
  parallel_for(executor, "flux cotangent", rows_, sum_row, kRowGrain);
}

}  // namespace lensforge
