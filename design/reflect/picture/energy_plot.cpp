// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/picture/energy_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/page/html_text.h"
#include "core/text/number_text.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {
namespace {

constexpr double kWidth = 900.0;
constexpr double kHeight = 300.0;
constexpr double kLeft = 70.0;
constexpr double kMargin = 30.0;
constexpr std::array<std::string_view, 3> kColors{"#0b5cad", "#a3161a", "#1b6b36"};
/// Where there is none, the energy that is drawn.
constexpr double kFloor = 1e-12;

/// From seconds and energies to the drawing.
class Axes {
 public:
  explicit Axes(const std::vector<ReflectUpdate>& updates)
      : seconds_(std::max(updates.back().seconds, 1e-3)) {
    const auto less = [](const ReflectUpdate& a, const ReflectUpdate& b) {
      return a.energy < b.energy;
    };
    const auto [least, most] = std::minmax_element(updates.begin(), updates.end(), less);
    low_ = static_cast<int>(std::floor(decade_of(least->energy)));
    high_ = std::max(low_ + 1, static_cast<int>(std::ceil(decade_of(most->energy))));
  }

  [[nodiscard]] double seconds() const { return seconds_; }
  [[nodiscard]] int low() const { return low_; }
  [[nodiscard]] int high() const { return high_; }
  [[nodiscard]] double x(double seconds) const {
    return kLeft + (kWidth - kLeft - kMargin) * seconds / seconds_;
  }
  [[nodiscard]] double y(double decade) const {
    return kHeight - kMargin - (kHeight - 2.0 * kMargin) * (decade - low_) / (high_ - low_);
  }
  [[nodiscard]] std::string point(const ReflectUpdate& update) const {
    return decimal_text(x(update.seconds), 1) + "," + decimal_text(y(decade_of(update.energy)), 1) +
           " ";
  }

 private:
  static double decade_of(double energy) { return std::log10(std::max(std::abs(energy), kFloor)); }

  double seconds_;
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

/// The stages' lines, each with its name.
std::string curves(const std::vector<ReflectUpdate>& updates, const Axes& axes) {
  std::string lines;
  std::size_t stage = 0;
  for (auto first = updates.begin(); first != updates.end(); ++stage) {
    const auto last = std::find_if(first, updates.end(), [&](const ReflectUpdate& update) {
      return update.stage != first->stage;
    });
    std::string points;
    for (auto update = first; update != last; ++update) points += axes.point(*update);
    const std::string_view color = kColors[stage % kColors.size()];
    lines += joined({"<polyline points=\"", points, "\" fill=\"none\" stroke-width=\"2\" stroke=\"",
                     color, "\"/>"});
    const double row = kMargin - 10.0;
    lines += words(kLeft + 130.0 * static_cast<double>(stage), row,
                   joined({"fill=\"", color, "\""}), first->stage);
    first = last;
  }
  return lines;
}

}  // namespace

std::string energy_plot(const std::vector<ReflectUpdate>& updates) {
  if (updates.size() < 2) return "";
  const Axes axes(updates);
  const std::string end = decimal_text(axes.seconds(), 1) + " s";
  return element("svg",
                 joined({"viewBox=\"0 0 ", decimal_text(kWidth, 0), " ", decimal_text(kHeight, 0),
                         "\" role=\"img\" aria-label=\"Energy over time\" font-size=\"13\" "
                         "font-family=\"Arial, sans-serif\" style=\"background:#fff\""}),
                 decades(axes) + curves(updates, axes) + words(kLeft, kHeight - 8.0, "", "0 s") +
                     words(kWidth - kMargin, kHeight - 8.0, "text-anchor=\"end\"", end));
}

}  // namespace lensforge::reflect
