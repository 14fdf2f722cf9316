// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/description.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

bool Limits::hold(double value) const {
  if (or_zero && value == 0.0) return true;
  return (low_excluded ? value > low : value >= low) && value <= high;
}

std::string Limits::rule() const {
  const std::string zero = or_zero ? "0, or " : "";
  if (std::isinf(high)) return zero + number_text(low) + " or more";
  return low_excluded ? zero + "above " + number_text(low) + ", at most " + number_text(high)
                      : zero + number_text(low) + " to " + number_text(high);
}

double number_of(const FieldValue& value) {
  const auto* const whole = std::get_if<int>(&value);
  return whole != nullptr ? *whole : std::get<double>(value);
}

void FieldSpec::require(const std::string& text, double value) const {
  if (limits.hold(value)) return;
  throw InputError(name + " " + text + ": must be " + limits.rule() +
                   (unit.empty() ? "" : " " + unit));
}

void FieldSpec::require_word(const std::string& text) const {
  if (std::find(words.begin(), words.end(), text) != words.end()) return;
  throw InputError(name + " " + text + ": must be one of " + joined(words, ", "));
}

namespace {

template <class Value>
Field plain(FieldSpec spec, const Place<Value>& at) {
  return {std::move(spec), [at] { return FieldValue(at()); },
          [at](const FieldValue& value) { at() = std::get<Value>(value); }};
}

}  // namespace

Field& Description::flag(const std::string& name, const Place<bool>& at, const std::string& help) {
  return add(plain({.name = name, .kind = FieldKind::kFlag, .help = help}, at));
}

Field& Description::without(const std::string& name, const Place<bool>& at,
                            const std::string& help) {
  Field& field = flag(name, at, help);
  field.get = [at] { return FieldValue(!at()); };
  field.set = [at](const FieldValue& value) { at() = !std::get<bool>(value); };
  field.stored = [at] { return FieldValue(at()); };
  return field;
}

Field& Description::whole(const std::string& name, const Place<int>& at, const Limits& limits,
                          const std::string& help) {
  return add(plain({.name = name, .kind = FieldKind::kWhole, .help = help, .limits = limits}, at));
}

Field& Description::whole(const std::string& name, std::int64_t& value, const Limits& limits,
                          const std::string& help) {
  return add({{.name = name, .kind = FieldKind::kWhole, .help = help, .limits = limits},
              [&value] { return static_cast<int>(value); },
              [&value](const FieldValue& given) { value = std::get<int>(given); }});
}

Field& Description::number(const std::string& name, const Place<double>& at, const Limits& limits,
                           const std::string& unit, const std::string& help) {
  return add(plain({name, FieldKind::kNumber, help, limits, unit}, at));
}

Field& Description::length(const std::string& name, const Place<double>& at, const Limits& limits,
                           const std::string& help) {
  return add(plain({name, FieldKind::kLength, help, limits, "mm"}, at));
}

Field& Description::text(const std::string& name, const Place<std::string>& at,
                         const std::string& unit, const std::string& help) {
  return add(plain({.name = name, .help = help, .unit = unit}, at));
}

Field& Description::text(const FieldSpec& spec, const std::function<std::string()>& get,
                         const std::function<void(const std::string&)>& set) {
  return add({spec, get, [set](const FieldValue& value) { set(std::get<std::string>(value)); }});
}

Field& Description::texts(const std::string& name, const Place<std::vector<std::string>>& at,
                          const std::string& unit, const std::string& help) {
  return add(plain({.name = name, .help = help, .unit = unit}, at));
}

Field& Description::like(const Field& other, const std::string& name, const std::string& help) {
  Field field = other;
  field.name = name;
  field.help = help;
  field.needed = field.zero_if_missing = false;
  if (field.kind == FieldKind::kWord) {
    field.set = [spec = FieldSpec(field), set = other.set](const FieldValue& value) {
      spec.require_word(std::get<std::string>(value));
      set(value);
    };
  }
  return add(std::move(field));
}

Field& Description::add(Field field) { return fields_.emplace_back(std::move(field)); }

void Description::add(const Description& other) {
  fields_.insert(fields_.end(), other.fields_.begin(), other.fields_.end());
  owned_.insert(owned_.end(), other.owned_.begin(), other.owned_.end());
}

Field Description::at(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const std::string_view name = path.substr(0, dot);
  const auto found = std::find_if(begin(), end(), [&](const Field& f) { return f.name == name; });
  LF_CHECK(found != end(), std::string(path));
  if (dot == std::string_view::npos) return *found;
  const std::string_view rest = path.substr(dot + 1);
  if (found->kind != FieldKind::kList) return found->parts().front().at(rest);
  Field field = found->example().at(rest);
  field.get = field.stored = nullptr;
  field.set = nullptr;
  return field;
}

Description Description::only(const std::set<std::string>& names) const {
  Description some = *this;
  std::erase_if(some.fields_, [&](const Field& field) { return !names.contains(field.name); });
  return some;
}

Description Description::except(const std::set<std::string>& names) const {
  Description some = *this;
  std::erase_if(some.fields_, [&](const Field& field) { return names.contains(field.name); });
  return some;
}

void Description::require_limits() const {
  for (const Field& field : fields_) {
    if (!field.is_number()) continue;
    const FieldValue value = field.get();
    if (std::holds_alternative<std::monostate>(value)) continue;
    field.require(number_text(number_of(value)), number_of(value));
  }
}

}  // namespace lensforge
