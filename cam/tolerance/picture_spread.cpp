// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/picture_spread.h"

#include <algorithm>
#include <cmath>

namespace lensforge {

void PictureSpread::add(const Image& picture) {
  const std::vector<double> values = encoded_values(picture);
  mean_.resize(values.size());
  squares_.resize(values.size());
  ++count_;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double before = values[i] - mean_[i];
    mean_[i] += before / static_cast<double>(count_);
    squares_[i] += before * (values[i] - mean_[i]);
  }
}

std::vector<double> PictureSpread::deviation() const {
  std::vector<double> deviation(squares_.size());
  const auto degrees = static_cast<double>(std::max<std::int64_t>(1, count_ - 1));
  std::transform(squares_.begin(), squares_.end(), deviation.begin(),
                 [degrees](double sum) { return std::sqrt(sum / degrees); });
  return deviation;
}

}  // namespace lensforge
