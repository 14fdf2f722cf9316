// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

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

}  // namespace lensforge
