// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/setup_json.h"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/image/rasters.h"
#include "core/io/lens_folder.h"
#include "core/optics/outline.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using nlohmann::ordered_json;

/// Maximum difference between two keys that state the same place or length, mm.
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

/// The outline in lens.json: its type, a circle's centre and radius, a rounded rectangle's radius,
/// a polygon's corners; mm.
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

/// outline_json() read back for a lens of this size. @throw InputError naming the field.
Outline read_outline(const JsonFields& outline, const Eigen::Vector2d& lens_size) {
  const std::string type = outline.text("type");
  if (type == "circle") return read_circle(outline, lens_size);
  if (type == "rounded_rectangle") return read_rounded(outline, lens_size);
  if (type == "polygon") return read_polygon(outline);
  outline.refuse("type", R"(it must be "circle", "rounded_rectangle" or "polygon")");
}

template <class Vector>
ordered_json array_of(const Vector& vector) {
  ordered_json array = ordered_json::array();
  for (const auto& entry : vector) array.push_back(entry);
  return array;
}

/// Direction along x that the viewer sees as the picture's right.
double right_along_x(const OpticalSetup& setup) {
  return setup.view == ViewSide::kFront ? -1.0 : 1.0;
}

ordered_json shape_json(const SourceShape& shape) {
  ordered_json rows = ordered_json::array();
  for (int r = 0; r < shape.rows; ++r) {
    const auto row = shape.weights.begin() + std::ptrdiff_t{r} * shape.columns;
    rows.push_back(std::vector<double>(row, row + shape.columns));
  }
  return rows;
}

/// An object of one of several kinds: its type and its fields.
template <class Kind>
ordered_json typed_json(const char* type, const Kind& object) {
  ordered_json document = {{"type", type}};
  document.update(json_of(description_of(object)));
  return document;
}

/// typed_json() read back.
template <class... Kinds>
void read_typed(const JsonFields& fields, std::variant<Kinds...>& object) {
  const std::string type = fields.text("type");
  const auto read = [&](auto& held) { read_json(description_of(held), fields); };
  const bool known =
      ((type == Kinds::kTraits.type && (read(object.template emplace<Kinds>()), true)) || ...);
  const std::array<std::string, sizeof...(Kinds)> types{Kinds::kTraits.type...};
  if (!known) fields.refuse("type", joined({"it must be \"", joined(types, "\" or \""), "\""}));
}

ordered_json source_json(const OpticalSetup& setup) {
  ordered_json source =
      std::visit([](const auto& lamp) { return typed_json(lamp.kTraits.type, lamp); }, setup.lamp);
  const SourceExtent& extent = setup.extent;
  if (extent.none()) return source;
  const LampTraits& lamp = traits(setup.lamp);
  source[lamp.width_key] = extent.width / lamp.unit;
  if (!extent.shape.is_disc()) source["shape"] = shape_json(extent.shape);
  return source;
}

SourceShape read_source_shape(const JsonFields& source) {
  SourceShape shape;
  const nlohmann::json& rows = source.at("shape");
  const auto refuse = [&] {
    source.refuse("shape", "it must be rows of numbers, all of the same length, at most " +
                               std::to_string(kMaxShapeSide) + " a side");
  };
  if (!rows.is_array() || rows.empty() || rows.size() > kMaxShapeSide) refuse();
  for (const nlohmann::json& row : rows) {
    if (!row.is_array() || row.empty() || row.size() != rows.front().size() ||
        row.size() > kMaxShapeSide) {
      refuse();
    }
    for (const nlohmann::json& weight : row) {
      if (!weight.is_number()) refuse();
      shape.weights.push_back(weight.get<double>());
    }
  }
  shape.rows = static_cast<int>(rows.size());
  shape.columns = static_cast<int>(rows.front().size());
  return shape;
}

void read_source(const JsonFields& source, OpticalSetup& setup) {
  read_typed(source, setup.lamp);
  const LampTraits& lamp = traits(setup.lamp);
  if (source.has(lamp.width_key)) setup.extent.width = source.number(lamp.width_key) * lamp.unit;
  if (source.has("shape")) setup.extent.shape = read_source_shape(source);
}

ordered_json screen_json(const OpticalSetup& setup) {
  const Eigen::Vector3d right = right_along_x(setup) * setup.screen_x;
  // Adding 0 turns -0 into 0.
  return {{"centre", array_of(setup.screen_centre())},
          {"right", array_of(Eigen::Vector3d(right.array() + 0.0))},
          {"up", array_of(setup.screen_y)},
          {"size", array_of(setup.image_size)}};
}

void read_front(const JsonFields& front, const std::filesystem::path& folder, OpticalSetup& setup) {
  const std::string type = front.text("type");
  if (type == "sphere") {
    SphericalFront sphere;
    read_json(description_of(sphere), front);
    setup.front = sphere;
  } else if (type == "heights") {
    HeightGrid grid = read_heights(named_file(front, "file", folder));
    setup.front =
        HeightFront{std::make_shared<HeightSpline>(std::move(grid)), front.number_pair("size")};
  } else if (type != "flat") {
    front.refuse("type", R"(it must be "flat", "sphere" or "heights")");
  } else if (front.number("z") != 0.0) {
    front.refuse("z", "it must be 0, where the lens begins");
  }
}

ordered_json front_json(const OpticalSetup& setup) {
  if (!setup.front) return {{"type", "flat"}, {"z", 0}};
  if (const auto* const map = std::get_if<HeightFront>(&*setup.front)) {
    return {{"type", "heights"}, {"file", lens_file::kFront}, {"size", array_of(map->size)}};
  }
  return typed_json("sphere", std::get<SphericalFront>(*setup.front));
}

void read_screen(const JsonFields& screen, OpticalSetup& setup) {
  setup.screen_x = right_along_x(setup) * screen.number_triple("right");
  setup.screen_y = screen.number_triple("up");
  setup.focal_length = screen.number_triple("centre").z();
}

SecondScreen read_second(const JsonFields& fields, OpticalSetup setup) {
  read_screen(fields, setup);
  SecondScreen second{setup.focal_length, fields.number_pair("size"),
                      fields.number_pair("image_origin"), setup.screen_x, setup.screen_y};
  const Eigen::Vector2d centre = second.image_origin + 0.5 * second.image_size;
  if (!((fields.number_triple("centre").head<2>() - centre).norm() <= kAgreement)) {
    fields.refuse("centre", "the picture's centre by image_origin and size is somewhere else");
  }
  return second;
}

}  // namespace

void require_agreement(const JsonFields& fields, const OpticalSetup& setup) {
  if (!fields.has("screen")) return;
  const JsonFields screen = fields.object("screen");
  const Eigen::Vector3d centre = screen.number_triple("centre");
  if (!((setup.screen_centre() - centre).norm() <= kAgreement)) {
    screen.refuse("centre",
                  "the picture's centre by focal_length, image_origin and image_size is "
                  "somewhere else");
  }
  if (!((screen.number_pair("size") - setup.image_size).norm() <= kAgreement)) {
    screen.refuse("size", "it must be image_size");
  }
}

ordered_json setup_json(const OpticalSetup& setup) {
  ordered_json document = {{"mode", traits(setup.body).mode}};
  const auto* const parallel = std::get_if<ParallelLight>(&setup.lamp);
  if (traits(setup.body).lit_from_above && parallel != nullptr) {
    constexpr double kDegrees = 180.0 / 3.14159265358979323846;
    document["incidence_deg"] = kDegrees * std::acos(-parallel->direction.z());
  }
  document["source"] = source_json(setup);
  if (traits(setup.body).transmits) document["front"] = front_json(setup);
  document["ior"] = setup.ior;
  if (!setup.spectrum.none()) document["spectrum"] = json_of(description_of(setup.spectrum));
  if (setup.fresnel) document["fresnel"] = true;
  if (!setup.screen_is_turned()) document["focal_length"] = setup.focal_length;
  document["lens_size"] = array_of(setup.lens_size);
  if (setup.outline) document["outline"] = outline_json(*setup.outline, setup.lens_size);
  document["image_size"] = array_of(setup.image_size);
  document["image_origin"] = array_of(setup.image_origin);
  document["screen"] = screen_json(setup);
  if (setup.second) {
    ordered_json& second = document["second"] = screen_json(on_second_screen(setup));
    second["image_origin"] = array_of(setup.second->image_origin);
  }
  document["pixels"] = array_of(setup.pixels);
  document["view"] = setup.view == ViewSide::kFront ? "front" : "rear";
  return document;
}

std::filesystem::path named_file(const JsonFields& fields, const std::string& field,
                                 const std::filesystem::path& folder) {
  const std::filesystem::path name = fields.text(field);
  if (name.empty() || name == ".." || name != name.filename()) {
    fields.refuse(field, "it must be the name of a file in the lens folder");
  }
  return folder / name;
}

OpticalSetup read_setup(const JsonFields& fields, const std::filesystem::path& folder) {
  OpticalSetup setup;
  setup.body = word_in(fields, "mode", named_bodies());
  read_source(fields.object("source"), setup);
  if (fields.has("front")) read_front(fields.object("front"), folder, setup);
  setup.ior = fields.number("ior");
  if (fields.has("spectrum")) {
    read_json(description_of(setup.spectrum), fields.object("spectrum"));
  }
  if (fields.has("fresnel")) setup.fresnel = fields.flag("fresnel");
  setup.lens_size = fields.number_pair("lens_size");
  if (fields.has("outline")) {
    setup.outline = read_outline(fields.object("outline"), setup.lens_size);
  }
  setup.image_size = fields.number_pair("image_size");
  setup.image_origin = fields.number_pair("image_origin");
  setup.pixels = fields.integer_pair("pixels");
  setup.view = word_in(fields, "view", named_views());
  if (fields.has("screen")) read_screen(fields.object("screen"), setup);
  if (!setup.screen_is_turned()) setup.focal_length = fields.number("focal_length");
  if (fields.has("second")) setup.second = read_second(fields.object("second"), setup);
  return setup;
}

}  // namespace lensforge
