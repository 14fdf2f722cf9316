// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/gradient_term.h"

#include <array>
#include <cstdint>

namespace lensforge {

double gradient_term(const Executor& executor, const PictureError& picture, double weight,
                     std::span<double> g_bar) {
  const std::int64_t columns = picture.columns;
  const std::int64_t rows = picture.rows;
  const auto at = [&](std::int64_t c, std::int64_t r) {
    return picture.error[static_cast<std::size_t>(r * columns + c)];
  };
  // Each pixel gathers all of its differences and counts half of each square, so that no two
  // pixels write to the same place.
  const auto pixel = [&](std::int64_t i) {
    const std::int64_t c = i % columns;
    const std::int64_t r = i / columns;
    const double e = at(c, r);
    double value = 0.0;
    double slope = 0.0;
    const auto difference = [&](double other) {
      value += 0.5 * (e - other) * (e - other);
      slope += 2.0 * (e - other);
    };
    if (c > 0) difference(at(c - 1, r));
    if (c + 1 < columns) difference(at(c + 1, r));
    if (r > 0) difference(at(c, r - 1));
    if (r + 1 < rows) difference(at(c, r + 1));
    g_bar[static_cast<std::size_t>(i)] += weight * slope;
    return std::array<double, 1>{value};
  };
  return parallel_sum<1>(executor, "gradient term", columns * rows, pixel)[0];
}

}  // namespace lensforge
