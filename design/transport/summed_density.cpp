// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/summed_density.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace lensforge {

namespace {

/// The integrals one pixel further to the right; `left` is the pixel's left side.
SummedDensity::Pixel advanced(const SummedDensity::Pixel& before, double left) {
  SummedDensity::Pixel after = before;
  after.value = 0.0;
  after.mass += before.value;
  after.first += before.value * (left + 0.5);
  after.second += before.value * (left * (left + 1.0) + 1.0 / 3.0);
  return after;
}

/// ∫ over heights y0 … y1 of a row whose integrals over all of x are `row`.
Moments strip(const SummedDensity::Pixel& row, double y0, double y1) {
  const double height = y1 - y0;
  const double middle = 0.5 * (y0 + y1);
  const double squares = height * (middle * middle + height * height / 12.0);
  return {row.mass * height, row.first * height, row.mass * height * middle,
          row.second * height + row.mass * squares};
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
    Pixel running;
    for (int c = 0; c < columns_; ++c) {
      const auto value = static_cast<double>(picture.at(c, r));
      LF_CHECK(value >= 0.0, std::to_string(value));
      running.value = scale * value;
      pixels_.push_back(running);
      running = advanced(running, c);
    }
    row_end_.push_back(running);
    Moments next = border_.back();
    next += strip(running, r, r + 1.0);
    border_.push_back(next);
  }
}

Moments SummedDensity::right_border(double y) const {
  const int row = std::clamp(static_cast<int>(y), 0, rows_ - 1);
  Moments sum = border_[static_cast<std::size_t>(row)];
  sum += strip(row_end_[static_cast<std::size_t>(row)], row, y);
  return sum;
}

}  // namespace lensforge
