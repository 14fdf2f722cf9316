// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "cam/milled_paths.h"
#include "core/lens/surface_field.h"

namespace lensforge::testing {

/// Samples the grid in tiles of several sizes with three threads: every bit has to be as in one
/// serial piece.
inline void expect_same_bits_in_tiles(const SurfaceField& field, const GridWindow& whole) {
  const SurfacePatch all = sampled(field, whole);
  for (const std::int64_t tile : {whole.columns, std::int64_t{37}, std::int64_t{64}}) {
    for (std::int64_t row = 0; row < whole.rows; row += tile) {
      for (std::int64_t column = 0; column < whole.columns; column += tile) {
        GridWindow part = whole;
        part.first_column = column;
        part.first_row = row;
        part.columns = std::min(tile, whole.columns - column);
        part.rows = std::min(tile, whole.rows - row);
        SurfacePatch patch;
        field.sample(part, Executor::cpu(3), patch);
        ASSERT_EQ(patch.cut.size(), all.cut.empty() ? 0U : patch.z.size());
        for (std::int64_t n = 0; n < part.size(); ++n) {
          const auto a = static_cast<std::size_t>(n);
          const auto b = static_cast<std::size_t>((row + n / part.columns) * whole.columns +
                                                  column + n % part.columns);
          ASSERT_EQ(patch.z[a], all.z[b]);
          ASSERT_EQ(patch.slope_x[a], all.slope_x[b]);
          ASSERT_EQ(patch.slope_y[a], all.slope_y[b]);
          if (!all.cut.empty()) {
            ASSERT_EQ(patch.cut[a], all.cut[b]);
          }
        }
      }
    }
  }
}

}  // namespace lensforge::testing
