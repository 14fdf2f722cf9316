// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "core/compute/run_control.h"

namespace lensforge {

/// Heights on a grid whose outermost samples lie on a rectangle's edges, mm: row by row from the
/// greatest y, each from the least x, as one sees the rectangle from +z.
struct HeightGrid {
  int columns = 0;
  int rows = 0;
  std::vector<float> heights;

  friend bool operator==(const HeightGrid&, const HeightGrid&) = default;
};

/// Samples each way of a grid that is read. A cubic needs four; 4096 on 100 mm are as fine as the
/// step that no cutter follows.
inline constexpr int kMinHeightSamples = 4;
inline constexpr int kMaxHeightSamples = 4096;

/// Reads the first channel of a picture of floats (EXR, PFM, TIFF), mm; of 64-bit ones rounded to
/// 32 bits.
/// @throw InputError naming the file if it is missing, no picture, of integers, has too few or too
///        many samples or one that is not finite, or stands otherwise than it is stored.
HeightGrid read_heights(const std::filesystem::path& path, const RunControl& run = {});

/// Writes an EXR file that read_heights() reads back to the bit; whole or not at all.
/// @throw RunError
void write_heights(const HeightGrid& grid, const std::filesystem::path& path);

}  // namespace lensforge
