// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/printed/printed_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lensforge {
namespace {

/// A pixel under the cell of a node, along one axis.
struct CellPixel {
  double middle = 0.0;  ///< From the node, mm.
  double share = 0.0;   ///< Of the cell.
};

std::vector<CellPixel> pixels_under(double node, double spacing, double pixel) {
  const double begin = node - 0.5 * spacing;
  const double end = node + 0.5 * spacing;
  std::vector<CellPixel> pixels;
  for (double k = std::round(begin / pixel); (k - 0.5) * pixel < end; k += 1.0) {
    const double low = std::max(begin, (k - 0.5) * pixel);
    const double high = std::min(end, (k + 0.5) * pixel);
    pixels.push_back({k * pixel - node, (high - low) / spacing});
  }
  return pixels;
}

}  // namespace

void PrintedField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  surface_.sample(window, executor, patch);
  std::vector<std::vector<CellPixel>> columns;
  for (std::int64_t i = 0; i < window.columns; ++i) {
    columns.push_back(pixels_under(window.x(i), window.spacing.x(), cell_.x()));
  }
  const auto print_row = [&](std::int64_t j) {
    const std::vector<CellPixel> row = pixels_under(window.y(j), window.spacing.y(), cell_.y());
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const std::vector<CellPixel>& column = columns[static_cast<std::size_t>(i)];
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      double mean = 0.0;
      for (const CellPixel& y : row) {
        const double z = patch.z[n] + patch.slope_y[n] * y.middle;
        double sum = 0.0;
        for (const CellPixel& x : column) {
          sum += x.share * std::round((z + patch.slope_x[n] * x.middle) / step_);
        }
        mean += y.share * sum;
      }
      patch.z[n] = step_ * mean;
    }
  };
  parallel_for(executor, "print", window.rows, print_row, 4);
}

}  // namespace lensforge
