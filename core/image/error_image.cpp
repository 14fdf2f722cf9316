// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/error_image.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

using Color = std::array<unsigned char, 3>;

constexpr int kShorterSide = 256;  ///< Below it the labels are illegible.
constexpr int kLongerSide = 4096;  ///< Maximum after enlarging.
constexpr double kSmallestScale = 1e-3;
constexpr double kPercentile = 0.995;
constexpr int kTicks = 5;

constexpr int kFontScale = 2;
constexpr int kGlyphColumns = 3;
constexpr int kGlyphRows = 5;
constexpr int kMargin = 8;
constexpr int kBarWidth = 14;
constexpr int kLabelChars = 7;
constexpr int kLegendWidth =
    3 * kMargin + kBarWidth + kLabelChars * (kGlyphColumns + 1) * kFontScale;
constexpr Color kPaper{255, 255, 255};
constexpr Color kInk{0, 0, 0};

/// A canvas with the few drawing functions needed here.
class Canvas {
 public:
  Canvas(int columns, int rows, const Color& fill) {
    image_.columns = columns;
    image_.rows = rows;
    for (int pixel = 0; pixel < columns * rows; ++pixel) {
      image_.rgb.insert(image_.rgb.end(), fill.begin(), fill.end());
    }
  }

  void fill(int left, int top, int width, int height, const Color& color) {
    for (int row = std::max(0, top); row < std::min(image_.rows, top + height); ++row) {
      for (int column = left; column < std::min(image_.columns, left + width); ++column) {
        const auto pixel =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(image_.columns) +
            static_cast<std::size_t>(column);
        std::copy(color.begin(), color.end(),
                  image_.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
      }
    }
  }

  void write(int left, int top, std::string_view text);

  [[nodiscard]] ColorImage image() && { return std::move(image_); }

 private:
  ColorImage image_;
};

/// Rows of a 3 × 5 glyph, the leftmost dot in the highest of three bits. A font file may not be
/// installed, and a scale needs only these characters.
std::array<int, kGlyphRows> glyph(char character) {
  static constexpr std::array<std::array<int, kGlyphRows>, 10> kDigits{{{7, 5, 5, 5, 7},
                                                                        {2, 6, 2, 2, 7},
                                                                        {7, 1, 7, 4, 7},
                                                                        {7, 1, 7, 1, 7},
                                                                        {5, 5, 7, 1, 1},
                                                                        {7, 4, 7, 1, 7},
                                                                        {7, 4, 7, 5, 7},
                                                                        {7, 1, 2, 2, 2},
                                                                        {7, 5, 7, 5, 7},
                                                                        {7, 5, 7, 1, 7}}};
  if (character >= '0' && character <= '9')
    return kDigits[static_cast<std::size_t>(character - '0')];
  if (character == '.') return {0, 0, 0, 0, 2};
  if (character == '>') return {4, 2, 1, 2, 4};
  return {};
}

void Canvas::write(int left, int top, std::string_view text) {
  for (const char character : text) {
    const auto rows = glyph(character);
    for (int dot = 0; dot < kGlyphColumns * kGlyphRows; ++dot) {
      const int row = dot / kGlyphColumns;
      const int column = dot % kGlyphColumns;
      const int bit = 4 >> column;
      if ((rows[static_cast<std::size_t>(row)] & bit) == 0) continue;
      fill(left + column * kFontScale, top + row * kFontScale, kFontScale, kFontScale, kInk);
    }
    left += (kGlyphColumns + 1) * kFontScale;
  }
}

double rounded_up(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    // The tolerance keeps 0.2 from becoming 0.5 when 0.2 / 0.1 rounds to just above 2.
    if (value <= step * decade * (1.0 + 1e-9)) return step * decade;
  }
  return 10.0 * decade;
}

struct Scale {
  double top = kSmallestScale;
  bool exceeded = false;
};

Scale choose_scale(std::vector<double> errors) {
  const auto rank =
      static_cast<std::ptrdiff_t>(kPercentile * static_cast<double>(errors.size() - 1));
  std::nth_element(errors.begin(), errors.begin() + rank, errors.end());
  Scale scale;
  scale.top = rounded_up(std::max(errors[static_cast<std::size_t>(rank)], kSmallestScale));
  scale.exceeded = *std::max_element(errors.begin() + rank, errors.end()) > scale.top;
  return scale;
}

int enlargement(int columns, int rows) {
  const int wanted = (kShorterSide + std::min(columns, rows) - 1) / std::min(columns, rows);
  return std::max(1, std::min(wanted, kLongerSide / std::max(columns, rows)));
}

/// The colour bar from row `top` down over `height` rows, its labels to the right.
void draw_legend(Canvas& canvas, int left, int top, int height, const Scale& scale) {
  canvas.fill(left - 1, top - 1, kBarWidth + 2, height + 2, kInk);
  for (int row = 0; row < height; ++row) {
    const double share = height > 1 ? 1.0 - static_cast<double>(row) / (height - 1) : 1.0;
    canvas.fill(left, top + row, kBarWidth, 1, false_color(share));
  }
  for (int tick = 0; tick <= kTicks; ++tick) {
    const double share = static_cast<double>(tick) / kTicks;
    const int row = top + static_cast<int>(std::lround((1.0 - share) * (height - 1)));
    canvas.fill(left + kBarWidth, row, kMargin / 2, 1, kInk);
    const bool above = tick == kTicks && scale.exceeded;
    canvas.write(left + kBarWidth + kMargin, row - kGlyphRows * kFontScale / 2,
                 std::string(above ? ">" : "").append(trimmed_decimal(share * scale.top, 5)));
  }
}

std::vector<double> absolute_errors(const Image& render, const Image& target) {
  std::vector<double> errors = encoded_values(render);
  const std::vector<double> wanted = encoded_values(target);
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = std::abs(errors[i] - wanted[i]);
  return errors;
}

}  // namespace

std::array<unsigned char, 3> false_color(double share) {
  // Anchors with lightness rising evenly, so that the picture also reads in grey print.
  static constexpr std::array<Color, 6> kAnchors{
      {{0, 0, 4}, {66, 10, 104}, {147, 38, 103}, {221, 81, 58}, {252, 165, 10}, {252, 255, 164}}};
  const double place = std::clamp(share, 0.0, 1.0) * (kAnchors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kAnchors.size() - 2);
  const double weight = place - static_cast<double>(below);
  Color color{};
  for (std::size_t c = 0; c < color.size(); ++c) {
    const double value = (1.0 - weight) * kAnchors[below][c] + weight * kAnchors[below + 1][c];
    color[c] = static_cast<unsigned char>(std::lround(value));
  }
  return color;
}

ColorImage false_color_image(const std::vector<double>& values, int columns, int rows) {
  LF_CHECK(columns > 0 && rows > 0 && std::ssize(values) == std::ptrdiff_t{columns} * rows,
           std::to_string(values.size()));
  const Scale scale = choose_scale(values);
  const int zoom = enlargement(columns, rows);
  const int width = columns * zoom;
  const int height = std::max(rows * zoom, kShorterSide);
  Canvas canvas(width + kLegendWidth, height, kPaper);
  std::size_t pixel = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      canvas.fill(column * zoom, row * zoom, zoom, zoom, false_color(values[pixel++] / scale.top));
    }
  }
  const int text_half = kGlyphRows * kFontScale / 2;
  draw_legend(canvas, width + kMargin, kMargin + text_half, height - 2 * (kMargin + text_half),
              scale);
  return std::move(canvas).image();
}

ColorImage error_image(const Image& render, const Image& target) {
  LF_CHECK(render.columns() == target.columns() && render.rows() == target.rows(),
           std::to_string(render.columns()) + "x" + std::to_string(render.rows()));
  LF_CHECK(!target.empty(), "no pixels");
  return false_color_image(absolute_errors(render, target), target.columns(), target.rows());
}

}  // namespace lensforge
