// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <span>

#include "core/image/image.h"

namespace lensforge {

/// A picture of values in double precision, row by row from the top. @pre columns × rows values.
inline Image image_of(std::span<const double> values, int columns, int rows) {
  Image image(columns, rows);
  std::transform(values.begin(), values.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

}  // namespace lensforge
