// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/json_fields.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

using nlohmann::json;

/// A value as JSON, cut to fit on a line.
std::string shown(const json& value) {
  constexpr std::size_t kLongest = 60;
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return printable_line(text, kLongest);
}

bool is_int(const json& value) {
  if (!value.is_number_integer()) return false;
  if (value.is_number_unsigned()) {
    return value.get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<int>::max()};
  }
  return std::in_range<int>(value.get<std::int64_t>());
}

bool is_pair(const json& value) { return value.is_array() && value.size() == 2; }

}  // namespace

JsonFields::JsonFields(const json& object, std::string file, std::string prefix)
    : object_(&object), file_(std::move(file)), prefix_(std::move(prefix)) {
  if (!object.is_object()) throw InputError(file_ + ": is no JSON object");
}

bool JsonFields::has(const std::string& name) const { return object_->contains(name); }

const json& JsonFields::at(const std::string& name) const {
  const auto found = object_->find(name);
  if (found == object_->end()) {
    throw InputError(file_ + ": field '" + prefix_ + name + "' is missing");
  }
  return *found;
}

JsonFields JsonFields::object(const std::string& name) const {
  if (!at(name).is_object()) refuse(name, "it must be an object");
  return JsonFields(at(name), file_, prefix_ + name + ".");
}

std::string JsonFields::text(const std::string& name) const {
  if (!at(name).is_string()) refuse(name, "it must be a text");
  return at(name).get<std::string>();
}

double JsonFields::number(const std::string& name) const {
  if (!at(name).is_number()) refuse(name, "it must be a number");
  return at(name).get<double>();
}

int JsonFields::integer(const std::string& name) const {
  if (!is_int(at(name))) refuse(name, "it must be a whole number");
  return at(name).get<int>();
}

Eigen::Vector2d JsonFields::number_pair(const std::string& name) const {
  const json& value = at(name);
  if (!is_pair(value) || !value[0].is_number() || !value[1].is_number()) {
    refuse(name, "it must be two numbers");
  }
  return {value[0].get<double>(), value[1].get<double>()};
}

Eigen::Vector3d JsonFields::number_triple(const std::string& name) const {
  const json& value = at(name);
  const auto is_number = [](const json& entry) { return entry.is_number(); };
  if (!value.is_array() || value.size() != 3 ||
      !std::all_of(value.begin(), value.end(), is_number)) {
    refuse(name, "it must be three numbers");
  }
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

Eigen::Vector2i JsonFields::integer_pair(const std::string& name) const {
  const json& value = at(name);
  if (!is_pair(value) || !is_int(value[0]) || !is_int(value[1])) {
    refuse(name, "it must be two whole numbers");
  }
  return {value[0].get<int>(), value[1].get<int>()};
}

void JsonFields::refuse(const std::string& name, const std::string& rule) const {
  throw InputError(file_ + ": field '" + prefix_ + name + "' is " + shown(at(name)) + ": " + rule);
}

}  // namespace lensforge
