// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

namespace lensforge {

/// A rendered picture compared with its target, both display-encoded, row by row from the top.
struct PictureError {
  int columns = 0;
  int rows = 0;
  std::span<const double> error;  ///< g − g̃ per pixel.
};

}  // namespace lensforge
