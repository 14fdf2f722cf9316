// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/density_blur.h"

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace lensforge {

namespace {

/// Blurs a line by one recursive pass each way (a discrete exponential). Work holds two lines.
void blur_line(std::span<double> line, double decay, std::vector<double>& work) {
  const std::size_t n = line.size();
  work.resize(n);
  // What the mirrored line, repeated for ever, has summed up before its start: a period is 2n.
  double before = 0.0;
  for (std::size_t i = 0; i < n; ++i) before = line[i] + decay * before;
  for (std::size_t i = n; i-- > 0;) before = line[i] + decay * before;
  double sum = before / (1.0 - std::pow(decay, 2.0 * static_cast<double>(n)));
  for (std::size_t i = 0; i < n; ++i) {
    sum = line[i] + decay * sum;
    work[i] = sum;
  }
  // Mirrored at the end, the sum from the right starts with the sum from the left.
  for (std::size_t i = n; i-- > 0;) {
    const double value = line[i];
    const double right = decay * sum;
    line[i] = (work[i] + right) * (1.0 - decay) / (1.0 + decay);
    sum = value + right;
  }
}

}  // namespace

Image soften(const Image& picture, double length, double floor) {
  const auto columns = static_cast<std::size_t>(picture.columns());
  const auto rows = static_cast<std::size_t>(picture.rows());
  std::vector<double> values(picture.values().begin(), picture.values().end());
  if (length > 0.0) {
    const double decay = std::exp(-1.0 / length);
    std::vector<double> work;
    for (std::size_t r = 0; r < rows; ++r) {
      blur_line(std::span(values).subspan(r * columns, columns), decay, work);
    }
    std::vector<double> column(rows);
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t r = 0; r < rows; ++r) column[r] = values[r * columns + c];
      blur_line(column, decay, work);
      for (std::size_t r = 0; r < rows; ++r) values[r * columns + c] = column[r];
    }
  }
  const double mean = picture.total() / static_cast<double>(values.size());
  Image result(picture.columns(), picture.rows());
  for (std::size_t i = 0; i < values.size(); ++i) {
    result.values()[i] = static_cast<float>((1.0 - floor) * values[i] + floor * mean);
  }
  return result;
}

}  // namespace lensforge
