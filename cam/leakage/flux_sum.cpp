// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/flux_sum.h"

#include <cstddef>

namespace lensforge {

FluxSum::FluxSum(int columns, int rows, const Executor& executor)
    : columns_(columns), rows_(rows), units_(static_cast<std::size_t>(executor.concurrency())) {
  const std::size_t stride = static_cast<std::size_t>(columns) + 1;
  for (auto& units : units_) units.assign(stride * static_cast<std::size_t>(rows), 0);
}

std::vector<double> FluxSum::flux() const {
  const std::size_t columns = static_cast<std::size_t>(columns_);
  std::vector<double> flux(columns * static_cast<std::size_t>(rows_));
  std::uint64_t running = 0;
  for (std::size_t i = 0; i < flux.size(); ++i) {
    const std::size_t row = i / columns;
    const std::size_t difference = i + row;  // Rows of differences are one column longer.
    if (i == row * columns) running = 0;
    for (const auto& units : units_) running += static_cast<std::uint64_t>(units[difference]);
    flux[i] = static_cast<double>(static_cast<std::int64_t>(running)) / kFluxUnits;
  }
  return flux;
}

}  // namespace lensforge
