// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"

namespace lensforge {

double Image::total() const {
  double sum = 0.0;
  for (const float value : values_) sum += static_cast<double>(value);
  return sum;
}

std::vector<double> encoded_values(const Image& image) {
  std::vector<double> encoded(image.values().size());
  std::transform(image.values().begin(), image.values().end(), encoded.begin(), [](float value) {
    return encode(std::clamp(static_cast<double>(value), 0.0, 1.0));
  });
  return encoded;
}

namespace {

// OpenImageIO's own box resize samples the filter at pixel centres: from 427² to 171² noise has
// errors up to 0.25 (version 2.4.7). Here every source pixel is weighted by its overlap with the
// result's pixel, computed in integers.

/// The source pixels first … first + weights.size() − 1 that one result pixel covers; Σ weights
/// = 1.
struct Coverage {
  int first = 0;
  std::vector<double> weights;
};

/// Along one axis source pixel j covers [j·to, (j+1)·to) and result pixel i [i·from, (i+1)·from)
/// in units of 1/(from·to) of the side.
std::vector<Coverage> coverages(int from, int to) {
  std::vector<Coverage> all(static_cast<std::size_t>(to));
  for (std::int64_t i = 0; i < to; ++i) {
    const std::int64_t begin = i * from;
    const std::int64_t end = begin + from;
    Coverage& coverage = all[static_cast<std::size_t>(i)];
    coverage.first = static_cast<int>(begin / to);
    for (std::int64_t j = coverage.first; j * to < end; ++j) {
      const std::int64_t shared = std::min(end, (j + 1) * to) - std::max(begin, j * to);
      coverage.weights.push_back(static_cast<double>(shared) / from);
    }
  }
  return all;
}

std::vector<double> resample_row(const Image& image, int row, const std::vector<Coverage>& across) {
  std::vector<double> result;
  result.reserve(across.size());
  for (const Coverage& coverage : across) {
    double sum = 0.0;
    int column = coverage.first;
    for (const double weight : coverage.weights) {
      sum += weight * static_cast<double>(image.at(column++, row));
    }
    result.push_back(sum);
  }
  return result;
}

void report_row(int row, int rows, const RunControl& run) {
  constexpr int kReports = 100;
  if (run.stop_requested()) throw Interrupted();
  if (row % std::max(1, rows / kReports) != 0) return;
  run.report({"resampling picture", static_cast<double>(row), static_cast<double>(rows), {}});
}

}  // namespace

Image resample(const Image& image, int columns, int rows, const RunControl& run) {
  LF_CHECK(columns >= 1 && rows >= 1 && !image.empty(),
           std::to_string(columns) + "x" + std::to_string(rows));
  const std::vector<Coverage> across = coverages(image.columns(), columns);
  const std::vector<Coverage> down = coverages(image.rows(), rows);
  Image result(columns, rows);
  std::vector<double> sum(across.size());
  std::vector<double> source;
  int source_row = -1;
  for (int row = 0; row < rows; ++row) {
    report_row(row, rows, run);
    const Coverage& coverage = down[static_cast<std::size_t>(row)];
    std::fill(sum.begin(), sum.end(), 0.0);
    for (std::size_t k = 0; k < coverage.weights.size(); ++k) {
      // Neighbouring result rows may share a source row; it is resampled once.
      if (const int needed = coverage.first + static_cast<int>(k); needed != source_row) {
        source = resample_row(image, needed, across);
        source_row = needed;
      }
      for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += coverage.weights[k] * source[c];
    }
    for (int c = 0; c < columns; ++c) {
      result.at(c, row) = static_cast<float>(sum[static_cast<std::size_t>(c)]);
    }
  }
  return result;
}

namespace {

// Notation (Wang et al. 2004, Eq. 13): a, b pictures; mean, var, cov over one window of N pixels;
// C1 = (K1 L)², C2 = (K2 L)² with L = 1.

constexpr double kC1 = 0.01 * 0.01;
constexpr double kC2 = 0.03 * 0.03;
constexpr int kWindow = 7;

/// Sums of a, b, a², b², ab.
using Sums = std::array<double, 5>;

void check_equal_sizes(const Image& a, const Image& b) {
  LF_CHECK(a.columns() == b.columns() && a.rows() == b.rows() && !a.empty(),
           std::to_string(a.columns()) + "x" + std::to_string(a.rows()) + " against " +
               std::to_string(b.columns()) + "x" + std::to_string(b.rows()));
}

Sums& operator+=(Sums& sum, const Sums& item) {
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += item[k];
  return sum;
}

double window_similarity(const Sums& sums, double count) {
  const double mean_a = sums[0] / count;
  const double mean_b = sums[1] / count;
  // Sample covariance divides by N − 1; a window of one pixel has none.
  const double sample = count > 1.0 ? count / (count - 1.0) : 0.0;
  const double var_a = sample * (sums[2] / count - mean_a * mean_a);
  const double var_b = sample * (sums[3] / count - mean_b * mean_b);
  const double cov = sample * (sums[4] / count - mean_a * mean_b);
  return ((2.0 * mean_a * mean_b + kC1) * (2.0 * cov + kC2)) /
         ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
}

/// Sums over `window` rows from `row` on, one entry per column.
std::vector<Sums> column_sums(std::span<const double> a, std::span<const double> b, int columns,
                              int row, int window) {
  std::vector<Sums> sums(static_cast<std::size_t>(columns), Sums{});
  for (int r = row; r < row + window; ++r) {
    const std::size_t begin = static_cast<std::size_t>(r) * sums.size();
    for (std::size_t c = 0; c < sums.size(); ++c) {
      const double x = a[begin + c];
      const double y = b[begin + c];
      sums[c] += {x, y, x * x, y * y, x * y};
    }
  }
  return sums;
}

double mean_similarity(std::span<const double> a, std::span<const double> b, int columns,
                       int rows) {
  const int fits = std::min({kWindow, columns, rows});
  const int window = fits % 2 == 1 ? fits : fits - 1;
  const double count = static_cast<double>(window) * window;
  double total = 0.0;
  // Each window is summed anew: 14 additions per pixel cost little and rounding errors do not
  // accumulate.
  for (int row = 0; row + window <= rows; ++row) {
    const std::vector<Sums> sums = column_sums(a, b, columns, row, window);
    for (std::size_t c = 0; c + static_cast<std::size_t>(window) <= sums.size(); ++c) {
      Sums in_window{};
      for (std::size_t k = 0; k < static_cast<std::size_t>(window); ++k) in_window += sums[c + k];
      total += window_similarity(in_window, count);
    }
  }
  return total / (static_cast<double>(columns - window + 1) * (rows - window + 1));
}

double mean_linear_error(const Image& render, const Image& target) {
  double sum = 0.0;
  float largest = 0.0F;
  for (std::size_t i = 0; i < target.values().size(); ++i) {
    sum += std::abs(static_cast<double>(render.values()[i]) - target.values()[i]);
    largest = std::max(largest, target.values()[i]);
  }
  const double scale = largest > 0.0F ? static_cast<double>(largest) : 1.0;
  return sum / (scale * static_cast<double>(target.values().size()));
}

}  // namespace

void describe(Description& d, ImageMetrics& metrics) {
  d.number("mae", metrics.mae, {}, "", "").needed = true;
  Field& psnr = d.number("psnr", metrics.psnr, {}, "", "");
  psnr.needed = psnr.infinite_if_null = true;
  d.number("ssim", metrics.ssim, {}, "", "").needed = true;
  d.number("flux_inside", metrics.flux_inside, {}, "", "").needed = true;
  d.number("mae_linear", metrics.mae_linear, {}, "", "");
}

ImageMetrics compare(const Image& render, const Image& target) {
  check_equal_sizes(render, target);
  const std::vector<double> shown = encoded_values(render);
  const std::vector<double> wanted = encoded_values(target);
  double absolute = 0.0;
  double squared = 0.0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const double error = shown[i] - wanted[i];
    absolute += std::abs(error);
    squared += error * error;
  }
  const auto count = static_cast<double>(shown.size());
  ImageMetrics metrics;
  metrics.mae = absolute / count;
  metrics.psnr =
      squared > 0.0 ? 10.0 * std::log10(count / squared) : std::numeric_limits<double>::infinity();
  metrics.ssim = mean_similarity(shown, wanted, target.columns(), target.rows());
  metrics.mae_linear = mean_linear_error(render, target);
  return metrics;
}

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
