// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/image/image.h"

namespace lensforge {

/// How much every pixel differs from part to part: the standard deviation of its display-encoded
/// value, 0 … 1, of all pictures that were added (Welford's sums, in one pass and constant memory).
class PictureSpread {
 public:
  /// Adds a part's picture; all of one size.
  void add(const Image& picture);

  /// Row by row from the top; zeros of one picture.
  [[nodiscard]] std::vector<double> deviation() const;

 private:
  std::int64_t count_ = 0;
  std::vector<double> mean_;
  std::vector<double> squares_;  ///< Sums of squared differences from the mean.
};

}  // namespace lensforge
