// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace lensforge {

/// A rendered picture compared with its target, both display-encoded, row by row from the top.
struct PictureError {
  int columns = 0;
  int rows = 0;
  const double* error = nullptr;  ///< g − g̃ per pixel, in the memory of the executor.

  [[nodiscard]] std::int64_t count() const { return static_cast<std::int64_t>(columns) * rows; }
};

}  // namespace lensforge
