// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/outline_setup.h"

#include <cmath>
#include <fstream>
#include <utility>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/svg_drawing.h"
#include "core/image/transfer.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "core/text/units.h"

namespace lensforge {
namespace {

const std::string kRounded = "rounded:";
constexpr const char* kCircleWouldDo = "; circle would do";

bool is_svg_file(const std::string& path) {
  std::ifstream file = open_input(path);
  return is_svg(file);
}

[[noreturn]] void refuse(const std::string& rule) { throw InputError("--outline: " + rule); }

}  // namespace

OutlineChoice outline_from(const std::string& text, const Background& background,
                           const RunControl& control) {
  if (text == "rectangle") return {};
  if (text == "circle") return {Outline{OutlineKind::kCircle, 0.0, {}}, {}};
  if (text.starts_with(kRounded)) {
    const double radius = parse_length_mm(text.substr(kRounded.size()), "--outline");
    return {Outline{OutlineKind::kRoundedRectangle, radius, {}}, {}};
  }
  std::error_code none;
  if (!std::filesystem::exists(text, none)) {
    refuse("'" + text + "': must be rectangle, circle, rounded:R with R in mm, or a picture" +
           kCircleWouldDo);
  }
  LoadedImage loaded = read_image(text, control, kOutlineDrawing, background);
  Image& picture = loaded.image;
  if (is_svg_file(text)) {
    // Its pixels are mean light: half of it is where the shape covers half.
    for (float& value : picture.values()) {
      value = static_cast<float>(decode(static_cast<double>(value)));
    }
  }
  return {Outline{OutlineKind::kPolygon, 0.0, contour_of(picture, text)},
          std::move(loaded.changes)};
}

Outline fitted(const Outline& outline, const Eigen::Vector2d& lens_size) {
  switch (outline.kind) {
    case OutlineKind::kCircle:
      return circle_outline(lens_size);
    case OutlineKind::kRoundedRectangle:
      return rounded_outline(lens_size, outline.radius);
    case OutlineKind::kPolygon:
      break;
  }
  return polygon_outline(lens_size, outline.points);
}

void require_outline(const std::optional<Outline>& outline, const Eigen::Vector2d& lens_size) {
  if (!outline) return;
  if (outline->kind == OutlineKind::kRoundedRectangle) {
    const double most = 0.5 * lens_size.minCoeff();
    if (!(outline->radius > 0.0 && outline->radius <= most)) {
      refuse("rounded:" + number_text(outline->radius) +
             ": the radius must be above 0 and at most " + number_text(most) +
             " mm, half of the lens's shorter side");
    }
  }
  if (outline->kind == OutlineKind::kPolygon) {
    if (const auto fault = polygon_fault(outline->points)) refuse(*fault + kCircleWouldDo);
  }
  const Outline inside = fitted(*outline, lens_size);
  if (const auto fault = polygon_fault(inside.points)) refuse(*fault + kCircleWouldDo);
  const double share = polygon_area(inside.points) / lens_size.prod();
  if (!(share >= kLeastOutlineShare)) {
    refuse("leaves " + number_text(100.0 * share, 2) + " % of the lens's rectangle of " +
           number_text(lens_size.x()) + " x " + number_text(lens_size.y()) +
           " mm to the light: must be at least " + number_text(100.0 * kLeastOutlineShare) + " %" +
           kCircleWouldDo);
  }
}

}  // namespace lensforge
