// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "cam/report/html_text.h"
#include "cam/report/relief_picture.h"
#include "cam/report/sections.h"
#include "core/text/number_text.h"

namespace lensforge::report_section {
namespace {

/// Decimals with which a scale of this range has three digits.
int decimals_for(double range) {
  if (range <= 0.0) return 2;
  return static_cast<int>(std::clamp(2.0 - std::floor(std::log10(range)), 0.0, 6.0));
}

/// Numbered rings at the worst places; the drawing has the lens's millimetres as units.
std::string place_rings(const ReportData& data) {
  const Eigen::Vector2d size = data.lens_size;
  const double unit = size.maxCoeff() / 100.0;
  std::string rings;
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    const LeakPlace& place = data.places[k];
    const std::string x = decimal_text(place.place.x(), 3);
    const std::string y = decimal_text(size.y() - place.place.y(), 3);
    const auto ring = [&](const char* color, double width) {
      return joined({"<circle cx=\"", x, "\" cy=\"", y, "\" r=\"",
                     decimal_text(std::max(3.5 * unit, 0.5 * place.side), 3),
                     "\" fill=\"none\" stroke=\"", color, "\" stroke-width=\"",
                     decimal_text(width * unit, 3), "\"/>"});
    };
    rings.append(ring("#000", 1.6)).append(ring("#fff", 0.8));
    // The number stays on the map.
    const double left = place.place.x() > 0.85 * size.x() ? -9.0 : 4.5;
    const double text_x =
        std::max(std::min(place.place.x() + left * unit, size.x() - 5.0 * unit), unit);
    const double text_y =
        std::max(std::min(size.y() - place.place.y() - 3.0 * unit, size.y() - unit), 6.5 * unit);
    rings.append(joined({"<text x=\"", decimal_text(text_x, 3), "\" y=\"", decimal_text(text_y, 3),
                         "\" font-size=\"", decimal_text(7.0 * unit, 3),
                         "\" font-weight=\"700\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"",
                         decimal_text(1.4 * unit, 3), "\" paint-order=\"stroke\">",
                         std::to_string(k + 1), "</text>"}));
  }
  return "<svg viewBox=\"0 0 " + decimal_text(size.x(), 3) + " " + decimal_text(size.y(), 3) +
         "\" aria-hidden=\"true\" font-family=\"Arial, sans-serif\">" + rings + "</svg>";
}

std::string map_figure(const ReportMap& map, const ReportData& data) {
  const auto [low, high] = std::minmax_element(map.raster.values.begin(), map.raster.values.end());
  const int decimals = decimals_for(*high - *low);
  const std::string picture = "<img src=\"" + png_uri(raster_picture(map.raster, *low, *high)) +
                              "\" alt=\"" + escape_html(map.title) + "\">";
  const std::string scale = decimal_text(*low, decimals) + " <img src=\"" +
                            png_uri(scale_picture()) + "\" alt=\"colour scale\"> " +
                            decimal_text(*high, decimals) + " " + escape_html(map.unit);
  const std::string caption = element("b", "", escape_html(map.title)) + "<br>" +
                              escape_html(map.note) + element("div", "class=\"scale\"", scale);
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
                  "Seen from above as it lies on the machine: x to the right, y away from the "
                  "operator. Rings with numbers are the worst places.") +
          element("div", "class=\"maps\"", figures));
}

}  // namespace lensforge::report_section
