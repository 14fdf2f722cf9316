// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace lensforge {

/// A grey picture in linear light, row 0 on top. 1 is display white; flux is proportional to it.
class Image {
 public:
  Image() = default;
  Image(int columns, int rows, float fill = 0.0F)
      : columns_(columns),
        rows_(rows),
        values_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), fill) {}

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] bool empty() const { return values_.empty(); }

  [[nodiscard]] float& at(int column, int row) { return values_[index(column, row)]; }
  [[nodiscard]] float at(int column, int row) const { return values_[index(column, row)]; }

  /// All values, row by row from the top.
  [[nodiscard]] std::span<float> values() { return values_; }
  [[nodiscard]] std::span<const float> values() const { return values_; }

  /// Sum of all values, in double precision and fixed order.
  [[nodiscard]] double total() const;

  friend bool operator==(const Image&, const Image&) = default;

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int columns_ = 0;
  int rows_ = 0;
  std::vector<float> values_;
};

/// The picture as shown: encode() of every value clipped to 0 … 1, row by row from the top.
std::vector<double> encoded_values(const Image& image);

}  // namespace lensforge
