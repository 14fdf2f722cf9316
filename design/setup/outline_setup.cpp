// SPDX-License-Identifier: GPL-3.0-or-later
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/svg_drawing.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Ring = bg::model::ring<Point, false>;

constexpr double kHalf = 0.5;

/// Follows the contour at one half through the cells between the pixels' centres (marching squares,
/// Lorensen and Cline 1987 in the plane). The picture gets a dark frame of one pixel.
class Contours {
 public:
  explicit Contours(const Image& picture)
      : picture_(picture), columns_(picture.columns() + 2), rows_(picture.rows() + 2) {
    for (std::int64_t row = 0; row + 1 < rows_; ++row) {
      for (std::int64_t column = 0; column + 1 < columns_; ++column) cross(column, row);
    }
  }

  /// Closed contours; with y upwards the light is on their left.
  [[nodiscard]] std::vector<Ring> lines() const {
    std::vector<Ring> lines;
    std::unordered_map<std::int64_t, bool> done;
    for (const std::int64_t start : starts_) {
      if (done[start]) continue;
      Ring line;
      for (std::int64_t edge = start; !done[edge]; edge = next_.at(edge)) {
        done[edge] = true;
        line.push_back(place(edge));
      }
      line.push_back(line.front());
      lines.push_back(std::move(line));
    }
    return lines;
  }

 private:
  /// Value of a pixel of the framed picture.
  [[nodiscard]] double value(std::int64_t column, std::int64_t row) const {
    const bool frame = column == 0 || row == 0 || column + 1 == columns_ || row + 1 == rows_;
    if (frame) return 0.0;
    return encode(
        static_cast<double>(picture_.at(static_cast<int>(column) - 1, static_cast<int>(row) - 1)));
  }

  /// Number of the line from a pixel's centre to that of its right or lower neighbour.
  [[nodiscard]] std::int64_t edge(std::int64_t column, std::int64_t row, bool down) const {
    return 2 * (row * columns_ + column) + (down ? 1 : 0);
  }

  /// Point where the contour crosses such a line.
  [[nodiscard]] Point place(std::int64_t edge) const {
    const bool down = edge % 2 == 1;
    const std::int64_t column = edge / 2 % columns_;
    const std::int64_t row = edge / 2 / columns_;
    const double from = value(column, row);
    const double to = down ? value(column, row + 1) : value(column + 1, row);
    const double share = (kHalf - from) / (to - from);
    return {static_cast<double>(column) + (down ? 0.0 : share),
            -static_cast<double>(row) - (down ? share : 0.0)};
  }

  /// Adds the contour through the cell to the right of and below a pixel's centre. Sides are
  /// ordered counter-clockwise with y upwards; side k runs from corner k to corner k + 1. With the
  /// light on its left, the contour enters through a side that goes from light to dark.
  void cross(std::int64_t column, std::int64_t row) {
    const double corners[4] = {value(column, row), value(column, row + 1),
                               value(column + 1, row + 1), value(column + 1, row)};
    const std::int64_t sides[4] = {edge(column, row, true), edge(column, row + 1, false),
                                   edge(column + 1, row, true), edge(column, row, false)};
    const auto lit = [&](int k) { return corners[k % 4] >= kHalf; };
    const bool middle = corners[0] + corners[1] + corners[2] + corners[3] >= 4.0 * kHalf;
    for (int k = 0; k < 4; ++k) {
      if (!(lit(k) && !lit(k + 1))) continue;
      // A saddle: around the dark corner if the middle is light, else around the light one.
      int out = k;
      const bool saddle = !lit(k + 3) && lit(k + 2);
      if (saddle) {
        out = middle ? k + 1 : k + 3;
      } else {
        while (!(!lit(out) && lit(out + 1))) out = out + 1;
      }
      starts_.push_back(sides[k]);
      next_[sides[k]] = sides[out % 4];
    }
  }

  const Image& picture_;
  std::int64_t columns_;
  std::int64_t rows_;
  std::vector<std::int64_t> starts_;
  std::unordered_map<std::int64_t, std::int64_t> next_;
};

}  // namespace

std::vector<Eigen::Vector2d> contour_of(const Image& picture, const std::string& what) {
  const std::vector<Ring> lines = Contours(picture).lines();
  const std::string subject = "--outline " + what + ": ";
  if (lines.empty()) {
    throw InputError(subject + "nothing in it is white: white must be lens, black none");
  }
  if (lines.size() > 1) {
    throw InputError(subject + "has " + std::to_string(lines.size()) +
                     " closed lines: must be one white piece without holes");
  }
  Ring simple;
  bg::simplify(lines.front(), simple, kOutlineTolerance);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t k = 0; k + 1 < simple.size(); ++k) {
    const Eigen::Vector2d p(simple[k].x(), simple[k].y());
    if (points.empty() || points.back() != p) points.push_back(p);
  }
  return points;
}

namespace {

const std::string kRounded = "rounded:";
constexpr const char* kCircleWorks = "; circle works";

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
           kCircleWorks);
  }
  LoadedImage loaded = read_image(text, control, kOutlineDrawing, background);
  Image& picture = loaded.image;
  if (is_svg_file(text)) {
    // Its pixels are mean light, so half of the value is where the shape covers half.
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
    if (const auto fault = polygon_fault(outline->points)) refuse(*fault + kCircleWorks);
  }
  const Outline inside = fitted(*outline, lens_size);
  if (const auto fault = polygon_fault(inside.points)) refuse(*fault + kCircleWorks);
  const double share = polygon_area(inside.points) / lens_size.prod();
  if (!(share >= kMinOutlineShare)) {
    refuse("leaves " + number_text(100.0 * share, 2) + " % of the lens's rectangle of " +
           number_text(lens_size.x()) + " x " + number_text(lens_size.y()) +
           " mm to the light: must be at least " + number_text(100.0 * kMinOutlineShare) + " %" +
           kCircleWorks);
  }
}

}  // namespace lensforge
