// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "cam/report/report_html.h"
#include "core/image/image.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr double kPercentile = 0.995;
constexpr double kSmallestTop = 1e-3;

double percentile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

void append(ColorImage& image, const std::array<unsigned char, 3>& color) {
  image.rgb.insert(image.rgb.end(), color.begin(), color.end());
}

/// Slope of a raster at (column, row counted from the least y), from its neighbours.
Eigen::Vector2d slope_at(const LensRaster& surface, const Eigen::Vector2d& step, int column,
                         int row) {
  const auto height = [&](int c, int r) {
    const int at = std::clamp(r, 0, surface.rows - 1) * surface.columns +
                   std::clamp(c, 0, surface.columns - 1);
    return static_cast<double>(surface.values[static_cast<std::size_t>(at)]);
  };
  return {(height(column + 1, row) - height(column - 1, row)) / (2.0 * step.x()),
          (height(column, row + 1) - height(column, row - 1)) / (2.0 * step.y())};
}

}  // namespace

ColorImage relief_picture(const LensRaster& surface, const Eigen::Vector2d& size) {
  const Eigen::Vector2d step(size.x() / std::max(1, surface.columns - 1),
                             size.y() / std::max(1, surface.rows - 1));
  std::vector<Eigen::Vector2d> slopes;
  std::vector<double> steep;
  for (int row = surface.rows - 1; row >= 0; --row) {
    for (int column = 0; column < surface.columns; ++column) {
      slopes.push_back(slope_at(surface, step, column, row));
      steep.push_back(slopes.back().norm());
    }
  }
  const double usual = std::max(1e-9, percentile(steep, 0.9));
  const Eigen::Vector3d light = Eigen::Vector3d(-0.6, 0.6, 0.75).normalized();
  ColorImage image{surface.columns, surface.rows, {}};
  for (const Eigen::Vector2d& slope : slopes) {
    const Eigen::Vector2d lean = slope / usual;
    const Eigen::Vector3d normal = Eigen::Vector3d(-lean.x(), -lean.y(), 1.0).normalized();
    const double shade = 0.1 + 0.9 * std::max(0.0, normal.dot(light));
    const auto grey = static_cast<unsigned char>(std::lround(255.0 * std::min(1.0, shade)));
    append(image, {grey, grey, grey});
  }
  return image;
}

double scale_top(const std::vector<double>& values) {
  return std::max(kSmallestTop, percentile(values, kPercentile));
}

ColorImage scaled_picture(const std::vector<double>& values, int columns, int rows, double top) {
  ColorImage image{columns, rows, {}};
  for (const double value : values) append(image, false_color(value / top));
  return image;
}

ColorImage raster_picture(const LensRaster& raster, double low, double high) {
  ColorImage image{raster.columns, raster.rows, {}};
  const double range = high > low ? high - low : 1.0;
  for (int row = raster.rows - 1; row >= 0; --row) {
    for (int column = 0; column < raster.columns; ++column) {
      const int at = row * raster.columns + column;
      const float value = raster.values[static_cast<std::size_t>(at)];
      append(image, false_color((static_cast<double>(value) - low) / range));
    }
  }
  return image;
}

}  // namespace lensforge

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
constexpr double kWidestRing = 12.0;
constexpr double kRingStroke = 0.8;  ///< Half of the black one's width.
constexpr double kFontSize = 7.0;
constexpr double kFontStroke = 1.4;
/// Of a digit of the widest bold fonts that stand in for Arial (DejaVu Sans), in font sizes.
constexpr double kDigitWidth = 0.7;
constexpr double kDigitHeight = 0.74;

/// Middle of the number's baseline: beside the ring towards the map's middle, and entirely on the
/// map.
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

void draw_ring(SvgWriter& svg, const Ring& ring, std::string_view stroke) {
  svg.circle(ring.centre, joined({svg.attribute("r", ring.radius), " fill=\"none\" ", stroke}));
}

void draw_number(SvgWriter& svg, const Ring& ring, const Eigen::Vector2d& size) {
  svg.text(number_place(ring, size),
           joined({"text-anchor=\"middle\" font-size=\"", decimal_text(kFontSize, 1),
                   "\" font-weight=\"700\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"",
                   decimal_text(kFontStroke, 1), "\" paint-order=\"stroke\""}),
           ring.number);
}

/// The ring moved as little as needed to lie on the map as a whole.
Ring on_map(Ring ring, const Eigen::Vector2d& size) {
  const double room = ring.radius + kRingStroke;
  for (int k = 0; k < 2; ++k) {
    const double low = std::min(room, 0.5 * size[k]);
    ring.centre[k] = std::clamp(ring.centre[k], low, size[k] - low);
  }
  return ring;
}

/// Numbered rings around the worst places, and a dot at each of them.
std::string place_rings(const ReportData& data) {
  const double unit = data.lens_size.maxCoeff() / 100.0;
  const Eigen::Vector2d size = data.lens_size / unit;
  SvgWriter svg(2);
  const std::size_t shown = data.places_matter() ? data.places.size() : 0;
  for (std::size_t k = 0; k < shown; ++k) {
    const LeakPlace& place = data.places[k];
    const Eigen::Vector2d centre = place.place / unit;
    const Ring around{{centre.x(), size.y() - centre.y()},
                      std::clamp(0.5 * place.side / unit, kRingRadius, kWidestRing),
                      std::to_string(k + 1)};
    const Ring ring = on_map(around, size);
    svg.circle(around.centre, "r=\"0.9\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"0.4\"");
    draw_ring(svg, ring, "stroke=\"#000\" stroke-width=\"1.6\"");
    draw_ring(svg, ring, "stroke=\"#fff\" stroke-width=\"0.8\"");
    draw_number(svg, ring, size);
  }
  return svg.drawing(
      joined({"viewBox=\"0 0 ", decimal_text(size.x(), 3), " ", decimal_text(size.y(), 3),
              "\" aria-hidden=\"true\" font-family=\"Arial, sans-serif\""}));
}

/// False for a map of one value, such as creases where there are none.
bool shows_anything(const ReportMap& map) {
  const auto [low, high] = std::minmax_element(map.raster.values.begin(), map.raster.values.end());
  return !map.raster.empty() && *low < *high;
}

std::string map_figure(const ReportMap& map, const ReportData& data) {
  const auto [low, high] = std::minmax_element(map.raster.values.begin(), map.raster.values.end());
  const int decimals = decimals_for(*high - *low);
  const std::string picture = "<img src=\"" + png_uri(raster_picture(map.raster, *low, *high)) +
                              "\" alt=\"" + escape_html(map.title) +
                              "\" style=\"aspect-ratio:" + decimal_text(data.lens_size.x(), 3) +
                              "/" + decimal_text(data.lens_size.y(), 3) + "\">";
  const std::string scale =
      html_scale(decimal_text(*low, decimals), decimal_text(*high, decimals) + " " + map.unit);
  const std::string caption =
      element("b", "", escape_html(map.title)) + "<br>" + escape_html(map.note) + scale;
  return element("figure", "class=\"map\" style=\"max-width:34rem\"",
                 element("div", "class=\"frame\"", picture + place_rings(data)) +
                     element("figcaption", "", caption));
}

}  // namespace

std::string maps(const ReportData& data) {
  std::string figures;
  for (const ReportMap& map : data.maps) {
    if (shows_anything(map)) figures += map_figure(map, data);
  }
  if (figures.empty()) return "";
  return element(
      "section", "",
      element("h2", "", "Maps of the " + escape_html(data.part)) +
          element("p", "",
                  std::string("Seen from above as mounted on the machine: x to the right, y away "
                              "from the operator.") +
                      (data.places_matter() ? " Rings with numbers are the worst places." : "")) +
          element("div", "class=\"maps\"", figures));
}

}  // namespace lensforge::report_section
