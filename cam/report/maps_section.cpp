// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "cam/report/relief_picture.h"
#include "cam/report/sections.h"
#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge::report_section {
namespace {

/// Decimals with which a scale of this range has three digits.
int decimals_for(double range) {
  if (range <= 0.0) return 2;
  return static_cast<int>(std::clamp(2.0 - std::floor(std::log10(range)), 0.0, 6.0));
}

/// A ring on a map that is `size` wide and high, in hundredths of its longer side.
struct Ring {
  Eigen::Vector2d centre;  ///< y down.
  double radius;
  std::string number;
};

constexpr double kRingRadius = 3.5;
constexpr double kFontSize = 7.0;
constexpr double kFontStroke = 1.4;
/// Of a digit of the widest bold fonts that stand in for Arial (DejaVu Sans), in font sizes.
constexpr double kDigitWidth = 0.7;
constexpr double kDigitHeight = 0.74;

/// Where the number's baseline has its middle: beside the ring towards the map's middle, and wholly
/// on the map.
Eigen::Vector2d number_place(const Ring& ring, const Eigen::Vector2d& size) {
  const double half =
      0.5 * (kDigitWidth * kFontSize * static_cast<double>(ring.number.size()) + kFontStroke);
  const double height = kDigitHeight * kFontSize + 0.5 * kFontStroke;
  const double away = 0.75 * ring.radius + half + kFontStroke;
  const double side = ring.centre.x() + away + half > size.x() ? -away : away;
  const auto within = [](double value, double low, double high) {
    return std::max(std::min(value, high), low);
  };
  return {within(ring.centre.x() + side, half, size.x() - half),
          within(ring.centre.y() - 0.75 * ring.radius, height, size.y() - 0.5 * kFontStroke)};
}

std::string ring_circle(const Ring& ring, const char* color, double width) {
  return joined({"<circle cx=\"", decimal_text(ring.centre.x(), 2), "\" cy=\"",
                 decimal_text(ring.centre.y(), 2), "\" r=\"", decimal_text(ring.radius, 2),
                 "\" fill=\"none\" stroke=\"", color, "\" stroke-width=\"", decimal_text(width, 1),
                 "\"/>"});
}

std::string ring_number(const Ring& ring, const Eigen::Vector2d& size) {
  const Eigen::Vector2d place = number_place(ring, size);
  return joined({"<text x=\"", decimal_text(place.x(), 2), "\" y=\"", decimal_text(place.y(), 2),
                 "\" text-anchor=\"middle\" font-size=\"", decimal_text(kFontSize, 1),
                 "\" font-weight=\"700\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"",
                 decimal_text(kFontStroke, 1), "\" paint-order=\"stroke\">", ring.number,
                 "</text>"});
}

/// Numbered rings at the worst places.
std::string place_rings(const ReportData& data) {
  const double unit = data.lens_size.maxCoeff() / 100.0;
  const Eigen::Vector2d size = data.lens_size / unit;
  std::string rings;
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    const LeakPlace& place = data.places[k];
    const Eigen::Vector2d centre = place.place / unit;
    const Ring ring{{centre.x(), size.y() - centre.y()},
                    std::max(kRingRadius, 0.5 * place.side / unit),
                    std::to_string(k + 1)};
    rings += ring_circle(ring, "#000", 1.6) + ring_circle(ring, "#fff", 0.8);
    rings += ring_number(ring, size);
  }
  return "<svg viewBox=\"0 0 " + decimal_text(size.x(), 3) + " " + decimal_text(size.y(), 3) +
         "\" aria-hidden=\"true\" font-family=\"Arial, sans-serif\">" + rings + "</svg>";
}

std::string map_figure(const ReportMap& map, const ReportData& data) {
  const auto [low, high] = std::minmax_element(map.raster.values.begin(), map.raster.values.end());
  const int decimals = decimals_for(*high - *low);
  const std::string picture = "<img src=\"" + png_uri(raster_picture(map.raster, *low, *high)) +
                              "\" alt=\"" + escape_html(map.title) + "\">";
  const std::string scale =
      html_scale(decimal_text(*low, decimals), decimal_text(*high, decimals) + " " + map.unit);
  const std::string caption =
      element("b", "", escape_html(map.title)) + "<br>" + escape_html(map.note) + scale;
  return element("figure", "class=\"map\"",
                 element("div", "class=\"frame\"", picture + place_rings(data)) +
                     element("figcaption", "", caption));
}

}  // namespace

std::string maps(const ReportData& data) {
  std::string figures;
  for (const ReportMap& map : data.maps) {
    if (!map.raster.empty()) figures += map_figure(map, data);
  }
  if (figures.empty()) return "";
  return element(
      "section", "",
      element("h2", "", "Maps of the " + escape_html(data.part)) +
          element("p", "",
                  "Seen from above as mounted on the machine: x to the right, y away from the "
                  "operator. Rings with numbers are the worst places.") +
          element("div", "class=\"maps\"", figures));
}

}  // namespace lensforge::report_section
