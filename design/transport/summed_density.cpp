// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/summed_density.h"

#include <cmath>
#include <string>

#include "core/error.h"

namespace lensforge {

namespace {

/// The integrals one pixel further to the right; `left` is the pixel's left side.
DensityPixel advanced(const DensityPixel& before, double left) {
  DensityPixel after = before;
  after.value = 0.0;
  after.mass += before.value;
  after.first += before.value * (left + 0.5);
  after.second += before.value * (left * (left + 1.0) + 1.0 / 3.0);
  return after;
}

}  // namespace

SummedDensity::SummedDensity(const Image& picture, double total)
    : columns_(picture.columns()), rows_(picture.rows()) {
  const double sum = picture.total();
  LF_CHECK(sum > 0.0 && std::isfinite(sum) && total > 0.0 && std::isfinite(total),
           std::to_string(sum) + " scaled to " + std::to_string(total));
  const double scale = total / sum;
  pixels_.reserve(picture.values().size());
  border_.emplace_back();
  for (int r = 0; r < rows_; ++r) {
    DensityPixel running;
    for (int c = 0; c < columns_; ++c) {
      const auto value = static_cast<double>(picture.at(c, r));
      LF_CHECK(value >= 0.0, std::to_string(value));
      running.value = scale * value;
      pixels_.push_back(running);
      running = advanced(running, c);
    }
    row_ends_.push_back(running);
    Moments next = border_.back();
    next += density_strip(running, r, r + 1.0);
    border_.push_back(next);
  }
}

}  // namespace lensforge
