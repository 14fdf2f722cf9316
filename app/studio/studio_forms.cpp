// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/studio/studio_forms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <variant>
#include <vector>

#include "app/batch/batch_job.h"
#include "app/commands/design_command.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/lens/setup_json.h"
#include "core/optics/material.h"
#include "core/optics/picture_blur.h"
#include "core/schema/description.h"
#include "core/schema/json.h"
#include "core/text/words.h"
#include "design/schedule/levels.h"

namespace lensforge::app {
namespace {

using nlohmann::json;

/// Options of the form, the usual ones first. Those that name files are not among them: a page
/// reaches nothing but its project.
constexpr std::array kFormOptions{
    "--lamp",         "--material",      "--width",        "--focal",       "--image-width",
    "--pixels",       "--thickness",     "--faces",        "--outline",     "--quality",
    "--model",        "--light-model",   "--image-offset", "--screen-tilt", "--view",
    "--mode",         "--incidence",     "--fresnel",      "--background",  "--second-focal",
    "--second-width", "--second-offset", "--second-tilt"};
/// Of these that name a file, is_flag_for_file().
constexpr std::array kFileFlags{"--made-by", "--second"};

template <std::size_t N>
bool is_among(const std::array<const char*, N>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const char* kind_word(FieldKind kind) {
  switch (kind) {
    case FieldKind::kFlag:
      return "flag";
    case FieldKind::kWhole:
      return "whole";
    case FieldKind::kNumber:
      return "number";
    case FieldKind::kLength:
      return "length";
    case FieldKind::kWord:
      return "word";
    default:
      return "text";
  }
}

json or_null(double bound) { return std::isfinite(bound) ? json(bound) : json(); }

json field_json(const Field& field, const std::string& name) {
  return {{"name", name},
          {"kind", kind_word(field.kind)},
          {"help", field.help},
          {"unit", field.kind == FieldKind::kLength ? "mm"
                   : field.is_number()              ? field.unit
                                                    : ""},
          {"rule", field.is_number() ? field.limits.rule() : ""},
          {"low", or_null(field.limits.low)},
          {"high", or_null(field.limits.high)},
          {"words", field.words},
          {"suggestions", json::array()},
          {"value", json_of(field.get())}};
}

json light_fields() {
  const Description all = description_of(DesignSettings());
  json fields = json::array();
  for (const char* name : kFormOptions) {
    json field = field_json(all.at(name), name);
    if (field["name"] == "--lamp") {
      field["suggestions"] = {"sun",   "led:3mm@600mm", "led:5mm@1m",
                              "torch", "laser:532nm",   "projector"};
    }
    if (field["name"] == "--material") field["suggestions"] = material_names();
    if (field["name"] == "--outline") field["suggestions"] = {"rectangle", "circle", "rounded:5"};
    fields.push_back(std::move(field));
  }
  for (const char* name : kFileFlags) {
    json field = field_json(all.at(name), name);
    field["kind"] = "flag";
    field["value"] = false;
    fields.push_back(std::move(field));
  }
  return fields;
}

/// Calls `visit` with every single field of a description and its path.
template <class Visit>
void walk(const Description& description, const std::string& prefix, const Visit& visit) {
  for (const Field& field : description) {
    const std::string path = prefix + field.name;
    if (field.kind == FieldKind::kTable) {
      walk(field.parts().front(), path + ".", visit);
    } else if (field.kind == FieldKind::kList) {
      const std::vector<Description> items = field.parts();
      for (std::size_t i = 0; i < items.size(); ++i) {
        walk(items[i], path + "." + std::to_string(i + 1) + ".", visit);
      }
    } else if (field.kind != FieldKind::kNumbers) {
      visit(field, path);
    }
  }
}

/// "finish" of "finish.pitch", "tool 2" of "tool.2.diameter" and "tool.2.section.1.length".
std::string section_of(const std::string& path) {
  const std::vector<std::string_view> parts = split(path, '.');
  std::string section(parts.front());
  const bool item = parts.size() > 2 && parts[1].find_first_not_of("0123456789") == parts[1].npos;
  if (item) section.append(" ").append(parts[1]);
  return section;
}

json workshop_sections() {
  json sections = json::array();
  walk(description_of(Workshop()), "", [&](const Field& field, const std::string& path) {
    const std::string name = section_of(path);
    const auto found = std::find_if(sections.begin(), sections.end(),
                                    [&](const json& one) { return one["name"] == name; });
    json& section =
        found != sections.end()
            ? *found
            : sections.emplace_back(json{{"name", name}, {"help", ""}, {"fields", json::array()}});
    section["fields"].push_back(field_json(field, path));
  });
  return sections;
}

/// A value as typed.
std::string text_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// @throw InputError where a text could name a file outside of the project.
void refuse_paths(const std::string& name, const json& value) {
  if (!value.is_string()) return;
  const auto text = value.get<std::string>();
  if (text.find('/') == std::string::npos && !text.starts_with('.') && !text.starts_with('-')) {
    return;
  }
  throw InputError(name + " " + printable_line(text) +
                   ": a page cannot name files outside of its project; the command can");
}

/// A value as JSON; whole numbers without a fraction, as one types them.
json plain(const FieldValue& value) {
  constexpr double kExact = 1e15;
  const double* const number = std::get_if<double>(&value);
  const bool whole =
      number != nullptr && *number == std::trunc(*number) && std::abs(*number) < kExact;
  return whole ? json(static_cast<std::int64_t>(*number)) : json_of(value);
}

/// The value that an option of a design gets: a length in mm. @throw InputError that begins with
/// the option's name.
json design_value(const std::string& name, const json& value) {
  static const Description known = description_of(DesignSettings());
  BatchStep step{"design", json::object()};
  try {
    step.set(name.substr(2), value);
    return value.is_boolean() ? value : plain(value_of(known.at(name), text_of(value)));
  } catch (const InputError& e) {
    const std::string words = e.what();
    const std::string before = step.command + " ";
    throw InputError(words.starts_with(before) ? words.substr(before.size()) : words);
  }
}

/// Sets a key of a workshop. @return its value, a length in mm. @throw InputError naming key, value
/// and rule.
json set_key(Workshop& workshop, const std::string& name, const json& value) {
  json taken;
  walk(description_of(workshop), "", [&](const Field& field, const std::string& path) {
    if (path != name) return;
    FieldSpec spec = field;
    spec.name = path;
    field.set(value_of(spec, text_of(value)));
    taken = plain(field.get());
  });
  if (taken.is_null()) throw InputError(name + ": a workshop has no such key");
  return taken;
}

}  // namespace

json studio_forms() { return {{"light", light_fields()}, {"workshop", workshop_sections()}}; }

bool is_flag_for_file(const std::string& name) { return is_among(kFileFlags, name); }

bool is_form_option(const std::string& name) {
  return is_flag_for_file(name) || is_among(kFormOptions, name);
}

bool is_plan_option(const std::string& name) {
  static const Description known = plan_call().options;
  return std::any_of(known.begin(), known.end(),
                     [&](const Field& field) { return field.name == name; });
}

json changed_settings(json settings, const json& changes) {
  if (!changes.is_object()) throw InputError("settings: must be an object of options and values");
  for (const auto& [name, value] : changes.items()) {
    if (!is_form_option(name)) throw InputError("option " + name + ": the page does not set it");
    if (value.is_null()) {
      settings.erase(name);
    } else if (!is_flag_for_file(name)) {
      settings[name] = design_value(name, value);
      refuse_paths(name, settings[name]);
    } else if (value.is_boolean()) {
      settings[name] = value;
    } else {
      throw InputError(name + ": must be true or false");
    }
  }
  if (settings.value("--second", false)) return settings;
  // Without a second picture nothing is left of its screen.
  for (const char* name : kFormOptions) {
    if (!std::string_view(name).starts_with("--second-")) continue;
    if (changes.contains(name) && !changes[name].is_null()) {
      throw InputError(std::string(name) + ": needs a second picture; choose one");
    }
    settings.erase(name);
  }
  return settings;
}

Workshop workshop_with(const json& values) {
  Workshop workshop;
  for (const auto& [name, value] : values.items()) set_key(workshop, name, value);
  validate(workshop, "workshop");
  return workshop;
}

json changed_workshop(json values, const json& changes) {
  if (!changes.is_object()) throw InputError("workshop: must be an object of keys and values");
  for (const auto& [name, value] : changes.items()) {
    if (value.is_null()) {
      values.erase(name);
      continue;
    }
    Workshop scratch;
    values[name] = set_key(scratch, name, value);
    refuse_paths(name, values[name]);
  }
  workshop_with(values);
  return values;
}

json wish_json(const ProposalWish& wish, const Eigen::Vector2i& picture) {
  const DesignOptions& design = wish.design;
  const Eigen::Vector2i pixels = working_size(picture.x(), picture.y(), design.pixels);
  validate(design, Image(pixels.x(), pixels.y(), 1.0F));
  const OpticalSetup setup = optical_setup(design, pixels);
  const std::vector<PictureBlur> blurs = blurs_of(wish, setup);
  return {{"setup", json(setup_json(setup))},
          {"lens_mm", {setup.lens_size.x(), setup.lens_size.y()}},
          {"focal_mm", design.focal_length},
          {"thickness_mm", design.thickness},
          {"pixels", {pixels.x(), pixels.y()}},
          {"blurs", blurs_json(blurs)},
          {"sharp_pixels", sharp_pixels(wish, picture)},
          {"words", blur_words(blurs)}};
}

}  // namespace lensforge::app
