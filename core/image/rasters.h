// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

/// Named rasters of one size, stored as the channels of an EXR file: heights and slopes of a
/// surface, pictures of several surfaces.
class LayeredImage {
 public:
  LayeredImage() = default;
  LayeredImage(int columns, int rows, std::vector<std::string> names);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] bool has(const std::string& name) const;

  /// One layer, row by row from the top. @pre has(name).
  [[nodiscard]] std::span<float> layer(const std::string& name);
  [[nodiscard]] std::span<const float> layer(const std::string& name) const;

 private:
  [[nodiscard]] std::size_t first_of(const std::string& name) const;

  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::string> names_;
  std::vector<float> values_;  ///< Layer by layer.
};

/// Writes losslessly compressed 32-bit floats; whole or not at all. @throw RunError
void write_layers(const LayeredImage& image, const std::filesystem::path& path);

/// @throw InputError if the file is missing, no EXR file, larger than kMaxImageSide per side, or
///        holds a value that is not finite; the message names the file.
LayeredImage read_layers(const std::filesystem::path& path);

/// Heights on a grid whose outermost samples lie on a rectangle's edges, mm: row by row from the
/// greatest y, each from the least x (the view from +z).
struct HeightGrid {
  int columns = 0;
  int rows = 0;
  std::vector<float> heights;

  friend bool operator==(const HeightGrid&, const HeightGrid&) = default;
};

/// Minimum and maximum samples each way of a grid to read. A cubic needs four; 4096 on 100 mm are
/// finer than any cutter follows.
inline constexpr int kMinHeightSamples = 4;
inline constexpr int kMaxHeightSamples = 4096;

/// Reads the first channel of a picture of floats (EXR, PFM, TIFF), mm; 64-bit values are rounded
/// to 32 bits.
/// @throw InputError naming the file if it is missing, no picture or of integers, if it has too few
///        or too many samples or one that is not finite, or if its display window or orientation
///        differs from the stored data.
HeightGrid read_heights(const std::filesystem::path& path, const RunControl& run = {});

/// Writes an EXR file that read_heights() reads back to the bit; whole or not at all.
/// @throw RunError
void write_heights(const HeightGrid& grid, const std::filesystem::path& path);

}  // namespace lensforge
