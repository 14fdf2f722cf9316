// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <string_view>
#include <variant>

#include "cam/report/sections.h"
#include "core/optics/front_surface.h"
#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge::report_section {
namespace {

constexpr double kWidth = 480.0;
constexpr double kMargin = 66.0;

/// A view of the setup: two of the three axes drawn right and up.
struct DrawnView {
  int right = 0;
  int up;
  Eigen::AlignedBox2d all;
  double scale;

  DrawnView(const SetupSheet& setup, bool from_above) : up(from_above ? 1 : 2) {
    all.extend(flat(setup.blank));
    all.extend(flat(setup.part));
    for (const NamedBox& clamp : setup.keep_outs) all.extend(flat(clamp.box));
    all.extend(Eigen::Vector2d(setup.zero[right], setup.zero[up]));
    const double wide = std::max(1e-6, all.sizes().x());
    // A thin blank is drawn no thinner than can be read, and no view taller than wide.
    scale = (kWidth - 2.0 * kMargin) / std::max(wide, all.sizes().y());
  }
  [[nodiscard]] Eigen::AlignedBox2d flat(const Eigen::AlignedBox3d& box) const {
    return {Eigen::Vector2d(box.min()[right], box.min()[up]),
            Eigen::Vector2d(box.max()[right], box.max()[up])};
  }
  [[nodiscard]] double height() const { return scale * all.sizes().y() + 2.0 * kMargin; }
  [[nodiscard]] double x(double mm) const { return kMargin + scale * (mm - all.min().x()); }
  [[nodiscard]] double y(double mm) const {
    return height() - kMargin - scale * (mm - all.min().y());
  }
};

std::string attribute(std::string_view name, double value) {
  return std::string(" ") + std::string(name) + "=\"" + decimal_text(value, 2) + "\"";
}

std::string rectangle(const DrawnView& view, const Eigen::AlignedBox3d& box,
                      std::string_view style) {
  const Eigen::AlignedBox2d flat = view.flat(box);
  return "<rect" + attribute("x", view.x(flat.min().x())) + attribute("y", view.y(flat.max().y())) +
         attribute("width", view.scale * flat.sizes().x()) +
         attribute("height", view.scale * flat.sizes().y()) + " " + std::string(style) + "/>";
}

std::string words(double x, double y, std::string_view style, std::string_view text) {
  return "<text" + attribute("x", x) + attribute("y", y) + " " + std::string(style) + ">" +
         escape_html(text) + "</text>";
}

/// y of the section through a front: its apex, or a height map's middle.
double section_y(const SphericalFront& front) { return front.apex.y(); }
double section_y(const HeightFront& front) { return front.corner.y() + 0.5 * front.size.y(); }

/// The blank seen from the front, in section through the apex of its front.
std::string section(const DrawnView& view, const SetupSheet& setup, std::string_view style) {
  const bool sphere = std::holds_alternative<SphericalFront>(*setup.front);
  const int parts = sphere ? 40 : 400;
  const FrontSurface front(*setup.front);
  const double y = std::visit([](const auto& one) { return section_y(one); }, *setup.front);
  const Eigen::AlignedBox2d blank = view.flat(setup.blank);
  const auto point = [&](double x, double z) {
    return decimal_text(view.x(x), 2) + "," + decimal_text(view.y(z), 2) + " ";
  };
  std::string points =
      point(blank.max().x(), blank.max().y()) + point(blank.min().x(), blank.max().y());
  for (int i = 0; i <= parts; ++i) {
    const double x = blank.min().x() + blank.sizes().x() * i / parts;
    points += point(x, front.height({x, y}));
  }
  return "<polygon points=\"" + points + "\" " + std::string(style) + "/>";
}

std::string blank_shape(const DrawnView& view, const SetupSheet& setup) {
  const std::string_view style = "fill=\"#e3ecf5\" stroke=\"#1a1f24\" stroke-width=\"2\"";
  if (setup.front && view.up == 2) return section(view, setup, style);
  return rectangle(view, setup.blank, style);
}

/// An arrow from the program's zero along an axis of the drawing.
std::string arrow(double x, double y, const Eigen::Vector2d& along, std::string_view name) {
  constexpr double kLength = 46.0;
  const Eigen::Vector2d tip(x + kLength * along.x(), y - kLength * along.y());
  const Eigen::Vector2d side(along.y(), along.x());
  const Eigen::Vector2d back(tip.x() - 9.0 * along.x(), tip.y() + 9.0 * along.y());
  const Eigen::Vector2d a = back + 4.5 * side;
  const Eigen::Vector2d b = back - 4.5 * side;
  const auto pair = [](const Eigen::Vector2d& p) {
    return decimal_text(p.x(), 2) + "," + decimal_text(p.y(), 2);
  };
  return "<line" + attribute("x1", x) + attribute("y1", y) + attribute("x2", tip.x()) +
         attribute("y2", tip.y()) + " stroke=\"#a3161a\" stroke-width=\"2.5\"/><polygon points=\"" +
         pair(tip) + " " + pair(a) + " " + pair(b) + "\" fill=\"#a3161a\"/>" +
         words(tip.x() + 6.0 * along.x() - 14.0 * along.y(),
               tip.y() - 4.0 * along.y() + 16.0 * along.x(),
               "font-size=\"15\" font-weight=\"700\" fill=\"#a3161a\"", name);
}

std::string zero_mark(const DrawnView& view, const SetupSheet& setup) {
  const double x = view.x(setup.zero[view.right]);
  const double y = view.y(setup.zero[view.up]);
  return arrow(x, y, {1.0, 0.0}, "X") + arrow(x, y, {0.0, 1.0}, view.up == 1 ? "Y" : "Z") +
         "<circle" + attribute("cx", x) + attribute("cy", y) +
         " r=\"6\" fill=\"#fff\" stroke=\"#a3161a\" stroke-width=\"2.5\"/>";
}

/// Width below and height at the right of the blank.
std::string dimensions(const DrawnView& view, const SetupSheet& setup) {
  const Eigen::AlignedBox2d blank = view.flat(setup.blank);
  const double middle = 0.5 * (view.y(blank.min().y()) + view.y(blank.max().y()));
  return words(0.5 * (view.x(blank.min().x()) + view.x(blank.max().x())), view.height() - 24.0,
               "font-size=\"15\" text-anchor=\"middle\"",
               "blank " + decimal_text(blank.sizes().x(), 1) + " mm") +
         words(kWidth - 6.0, middle + 5.0,
               "font-size=\"15\" text-anchor=\"middle\" transform=\"rotate(-90 " +
                   decimal_text(kWidth - 12.0, 2) + " " + decimal_text(middle, 2) + ")\"",
               decimal_text(blank.sizes().y(), 1) + " mm");
}

std::string clamps(const DrawnView& view, const SetupSheet& setup) {
  std::string svg;
  for (const NamedBox& clamp : setup.keep_outs) {
    svg +=
        rectangle(view, clamp.box, "fill=\"url(#hatch)\" stroke=\"#1a1f24\" stroke-width=\"1.5\"");
    const Eigen::AlignedBox2d flat = view.flat(clamp.box);
    svg += words(view.x(flat.center().x()), view.y(flat.max().y()) - 5.0,
                 "font-size=\"13\" text-anchor=\"middle\"", clamp.name);
  }
  return svg;
}

}  // namespace

std::string setup_drawing(const SetupSheet& setup, bool from_above) {
  const DrawnView view(setup, from_above);
  const std::string hatch =
      "<defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" "
      "patternTransform=\"rotate(45)\"><rect width=\"7\" height=\"7\" fill=\"#fff\"/><line "
      "y2=\"7\" stroke=\"#56616b\" stroke-width=\"2.5\"/></pattern></defs>";
  const std::string open =
      "<svg viewBox=\"0 0 " + decimal_text(kWidth, 0) + " " + decimal_text(view.height(), 0) +
      "\" role=\"img\" aria-label=\"Blank, part and zero seen from " +
      (from_above ? "above" : "the front") + "\" font-family=\"Arial, sans-serif\">";
  return open + (from_above ? hatch : "") + blank_shape(view, setup) +
         rectangle(view, setup.part,
                   "fill=\"#b9d3ea\" stroke=\"#0b5cad\" stroke-width=\"2\" "
                   "stroke-dasharray=\"6 4\"") +
         clamps(view, setup) + dimensions(view, setup) + zero_mark(view, setup) + "</svg>";
}

}  // namespace lensforge::report_section
