// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image.h"

#include <algorithm>

#include "core/image/transfer.h"

namespace lensforge {

double Image::total() const {
  double sum = 0.0;
  for (const float value : values_) sum += static_cast<double>(value);
  return sum;
}

std::vector<double> encoded_values(const Image& image) {
  std::vector<double> encoded(image.values().size());
  std::transform(image.values().begin(), image.values().end(), encoded.begin(), [](float value) {
    return encode(std::clamp(static_cast<double>(value), 0.0, 1.0));
  });
  return encoded;
}

}  // namespace lensforge
