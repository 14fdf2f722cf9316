// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/outline_json.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

using nlohmann::ordered_json;

/// Maximum deviation of a circle from the one in the lens's rectangle, mm.
constexpr double kAgreement = 1e-6;

Outline read_circle(const JsonFields& fields, const Eigen::Vector2d& size) {
  Outline circle = circle_outline(size);
  if (!((fields.number_pair("centre") - 0.5 * size).norm() <= kAgreement)) {
    fields.refuse("centre", "it must be the middle of lens_size");
  }
  if (!(std::abs(fields.number("radius") - circle.radius) <= kAgreement)) {
    fields.refuse("radius", "it must be half of the shorter side of lens_size, " +
                                number_text(circle.radius));
  }
  return circle;
}

Outline read_rounded(const JsonFields& fields, const Eigen::Vector2d& size) {
  const double radius = fields.number("radius");
  if (!(radius > 0.0 && radius <= 0.5 * size.minCoeff())) {
    fields.refuse("radius", "it must be above 0 and at most half of the shorter side, " +
                                number_text(0.5 * size.minCoeff()));
  }
  return rounded_outline(size, radius);
}

Outline read_polygon(const JsonFields& fields) {
  Outline polygon{OutlineKind::kPolygon, 0.0, {}};
  const nlohmann::json& points = fields.at("points");
  const auto is_pair = [](const nlohmann::json& p) {
    return p.is_array() && p.size() == 2 && p[0].is_number() && p[1].is_number();
  };
  if (!points.is_array()) fields.refuse("points", "it must be a list of [x, y]");
  for (const nlohmann::json& p : points) {
    if (!is_pair(p)) fields.refuse("points", "it must be a list of [x, y]");
    polygon.points.emplace_back(p[0].get<double>(), p[1].get<double>());
  }
  return polygon;
}

}  // namespace

ordered_json outline_json(const Outline& outline, const Eigen::Vector2d& lens_size) {
  switch (outline.kind) {
    case OutlineKind::kCircle:
      return {{"type", "circle"},
              {"centre", {0.5 * lens_size.x(), 0.5 * lens_size.y()}},
              {"radius", outline.radius}};
    case OutlineKind::kRoundedRectangle:
      return {{"type", "rounded_rectangle"}, {"radius", outline.radius}};
    case OutlineKind::kPolygon:
      break;
  }
  ordered_json points = ordered_json::array();
  for (const Eigen::Vector2d& p : outline.points) points.push_back({p.x(), p.y()});
  return {{"type", "polygon"}, {"points", points}};
}

Outline read_outline(const JsonFields& outline, const Eigen::Vector2d& lens_size) {
  const std::string type = outline.text("type");
  if (type == "circle") return read_circle(outline, lens_size);
  if (type == "rounded_rectangle") return read_rounded(outline, lens_size);
  if (type == "polygon") return read_polygon(outline);
  outline.refuse("type", R"(it must be "circle", "rounded_rectangle" or "polygon")");
}

}  // namespace lensforge
