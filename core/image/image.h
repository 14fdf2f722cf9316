// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

class Description;

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

/// The light of a coloured picture that its grey picture has: all of it by brightness (Rec. 709),
/// or that of one of sRGB's primaries.
enum class KeptLight { kAll, kRed, kGreen, kBlue };

/// Maximum side of a picture; a larger file is refused before its pixels are read.
inline constexpr int kMaxImageSide = 16384;

/// The picture as shown: encode() of every value clipped to 0 … 1, row by row from the top.
std::vector<double> encoded_values(const Image& image);

/// An 8-bit sRGB colour picture, row by row from the top, three bytes per pixel.
struct ColorImage {
  int columns = 0;
  int rows = 0;
  std::vector<unsigned char> rgb;
};

/// Box-filter (area-weighted) resampling in linear light: the mean value is kept to 1e-6 relative.
/// Progress is reported in rows of the result. @pre columns, rows ≥ 1. @throw Interrupted.
Image resample(const Image& image, int columns, int rows, const RunControl& run = {});

/// Bilinear interpolation between pixel centres; beyond the outermost centres the border pixel's
/// value.
/// @param at  pixels, x() to the right and y() down from the upper left corner.
template <class Point>
double bilinear(const Image& image, const Point& at) {
  const double x = std::clamp(at.x() - 0.5, 0.0, image.columns() - 1.0);
  const double y = std::clamp(at.y() - 0.5, 0.0, image.rows() - 1.0);
  const int c = static_cast<int>(x);
  const int r = static_cast<int>(y);
  const int right = std::min(c + 1, image.columns() - 1);
  const int below = std::min(r + 1, image.rows() - 1);
  const double fx = x - c;
  const double fy = y - r;
  const double upper = (1.0 - fx) * image.at(c, r) + fx * image.at(right, r);
  const double lower = (1.0 - fx) * image.at(c, below) + fx * image.at(right, below);
  return (1.0 - fy) * upper + fy * lower;
}

/// Differences between a projected picture and its target (docs/interface.md, "Metrics").
struct ImageMetrics {
  double mae = 0.0;   ///< Mean absolute error of the display-encoded values, 0 … 1.
  double psnr = 0.0;  ///< Peak signal-to-noise ratio of the same, dB; +inf when equal.
  /// Mean structural similarity of the same with 7 × 7 uniform windows, K1 = 0.01, K2 = 0.03,
  /// sample covariance (Wang et al. 2004; scikit-image's structural_similarity, data_range = 1).
  /// Pictures smaller than a window use the largest odd window that fits.
  double ssim = 0.0;
  double mae_linear = 0.0;   ///< Mean absolute error of linear flux ÷ largest target flux.
  double flux_inside = 1.0;  ///< Share of the flux that lands on the image rectangle.
};

void describe(Description& d, ImageMetrics& metrics);

/// Compares `render` with `target`, both linear light relative to the same white. Sets all but
/// flux_inside. @pre equal sizes.
ImageMetrics compare(const Image& render, const Image& target);

/// False colour for `share`, clipped to 0 … 1: from black through violet, red and yellow to near
/// white, with increasing lightness.
std::array<unsigned char, 3> false_color(double share);

/// Values ≥ 0 in false colour, each pixel enlarged by a whole factor so that the shorter side has
/// at least 256, with a colour bar and its labels at the right. The scale runs from 0 to the 99.5th
/// percentile of the values, rounded up to 1, 2 or 5 times a power of ten, 0.001 at least; values
/// above it show the bar's top colour, and the top label then reads ">…".
/// @param values  columns × rows, row by row from the top. @pre neither is 0.
ColorImage false_color_image(const std::vector<double>& values, int columns, int rows);

/// |encode(render) − encode(target)| as a false_color_image(). @pre equal sizes.
ColorImage error_image(const Image& render, const Image& target);

}  // namespace lensforge
