// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/decade_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kWidth = 900.0;
constexpr double kHeight = 300.0;
constexpr double kLeft = 70.0;
constexpr double kMargin = 30.0;
constexpr std::array<std::string_view, 8> kColors{"#0b5cad", "#a3161a", "#1b6b36", "#7a4fa3",
                                                  "#a35a00", "#007a7a", "#5c5c5c", "#b0307a"};
/// Layout of the names in lines above the plot.
constexpr std::size_t kNamesPerLine = 4;
constexpr double kNameWidth = 190.0;
constexpr double kNameHeight = 18.0;
/// Lower values, such as 0, are drawn at this one.
constexpr double kFloor = 1e-12;

/// Maps seconds and values to drawing coordinates.
class Axes {
 public:
  explicit Axes(const std::vector<PlotCurve>& curves) {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const PlotCurve& curve : curves) {
      for (const Eigen::Vector2d& point : curve.points) {
        seconds_ = std::max(seconds_, point.x());
        least = std::min(least, decade_of(point.y()));
        most = std::max(most, decade_of(point.y()));
      }
    }
    low_ = static_cast<int>(std::floor(least));
    high_ = std::max(low_ + 1, static_cast<int>(std::ceil(most)));
    top_ += kNameHeight * static_cast<double>((curves.size() - 1) / kNamesPerLine);
  }

  [[nodiscard]] double seconds() const { return seconds_; }
  [[nodiscard]] int low() const { return low_; }
  [[nodiscard]] int high() const { return high_; }
  [[nodiscard]] double x(double seconds) const {
    return kLeft + (kWidth - kLeft - kMargin) * seconds / seconds_;
  }
  [[nodiscard]] double y(double decade) const {
    return kHeight - kMargin - (kHeight - kMargin - top_) * (decade - low_) / (high_ - low_);
  }
  [[nodiscard]] std::string drawn(const Eigen::Vector2d& point) const {
    return decimal_text(x(point.x()), 1) + "," + decimal_text(y(decade_of(point.y())), 1) + " ";
  }

 private:
  static double decade_of(double value) { return std::log10(std::max(std::abs(value), kFloor)); }

  double top_ = kMargin;
  double seconds_ = 1e-3;
  int low_ = 0;
  int high_ = 1;
};

std::string words(double x, double y, std::string_view attributes, std::string_view text) {
  return element(
      "text",
      joined({"x=\"", decimal_text(x, 1), "\" y=\"", decimal_text(y, 1), "\" ", attributes}),
      escape_html(text));
}

std::string decades(const Axes& axes) {
  std::string lines;
  for (int decade = axes.low(); decade <= axes.high(); ++decade) {
    const std::string y = decimal_text(axes.y(decade), 1);
    lines += joined({"<path d=\"M", decimal_text(kLeft, 0), " ", y, "H",
                     decimal_text(kWidth - kMargin, 0), "\" stroke=\"#c9d0d6\"/>"});
    lines += words(kLeft - 8.0, axes.y(decade) + 4.0, "text-anchor=\"end\"",
                   "1e" + std::to_string(decade));
  }
  return lines;
}

/// The curves, each with its name.
std::string lines_of(const std::vector<PlotCurve>& curves, const Axes& axes) {
  std::string lines;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    std::string points;
    for (const Eigen::Vector2d& point : curves[i].points) points += axes.drawn(point);
    const std::string_view color = kColors[i % kColors.size()];
    lines += joined({"<polyline points=\"", points, "\" fill=\"none\" stroke-width=\"2\" stroke=\"",
                     color, "\"/>"});
    lines += words(kLeft + kNameWidth * static_cast<double>(i % kNamesPerLine),
                   kMargin - 10.0 + kNameHeight * static_cast<double>(i / kNamesPerLine),
                   joined({"fill=\"", color, "\""}), curves[i].name);
  }
  return lines;
}

}  // namespace

std::string decade_plot(const std::vector<PlotCurve>& curves, std::string_view label) {
  std::size_t points = 0;
  for (const PlotCurve& curve : curves) points += curve.points.size();
  if (points < 2) return "";
  const Axes axes(curves);
  const std::string end = decimal_text(axes.seconds(), 1) + " s";
  return element(
      "svg",
      joined({"xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ", decimal_text(kWidth, 0), " ",
              decimal_text(kHeight, 0), "\" role=\"img\" aria-label=\"", escape_html(label),
              "\" font-size=\"13\" font-family=\"Arial, sans-serif\" style=\"background:#fff\""}),
      decades(axes) + lines_of(curves, axes) + words(kLeft, kHeight - 8.0, "", "0 s") +
          words(kWidth - kMargin, kHeight - 8.0, "text-anchor=\"end\"", end));
}

}  // namespace lensforge
