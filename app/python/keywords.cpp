// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/python/keywords.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "core/schema/option_text.h"

namespace lensforge::python {
namespace {

bool is_bool(py::handle value) { return PyBool_Check(value.ptr()) != 0; }
bool is_whole(py::handle value) { return !is_bool(value) && PyIndex_Check(value.ptr()) != 0; }
bool is_number(py::handle value) {
  return is_whole(value) || PyFloat_Check(value.ptr()) != 0 ||
         py::isinstance(value, py::module_::import("numpy").attr("floating"));
}
bool is_text(py::handle value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

std::string number_word(py::handle value) {
  if (is_whole(value)) return py::str(py::int_(py::reinterpret_borrow<py::object>(value)));
  return py::repr(py::float_(py::reinterpret_borrow<py::object>(value)));
}

std::string text_word(py::handle value) {
  return py::module_::import("os").attr("fspath")(value).cast<std::string>();
}

/// "1.5,2": several numbers are one text; empty if one of them is none.
std::string list_word(py::handle values) {
  std::string text;
  for (const py::handle value : values) {
    if (!is_number(value)) return {};
    if (!text.empty()) text += ",";
    text += number_word(value);
  }
  return text;
}

/// A whole number beyond the range of doubles is infinite: it breaks every option's limits.
double number_of(py::handle value) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() == nullptr) return number;
  if (PyErr_ExceptionMatches(PyExc_OverflowError) == 0) throw py::error_already_set();
  PyErr_Clear();
  return std::numeric_limits<double>::infinity();
}

FieldValue number_value(const FieldSpec& spec, py::handle value) {
  const double number = number_of(value);
  spec.require(number_word(value), number);
  return spec.kind == FieldKind::kWhole ? FieldValue(static_cast<int>(number)) : number;
}

/// The text of a word, length or text; empty if it is none.
std::string text_of(const FieldSpec& spec, py::handle value) {
  if (is_text(value)) return spec.kind == FieldKind::kNumber ? "" : text_word(value);
  const bool list = spec.kind == FieldKind::kText && py::isinstance<py::sequence>(value);
  return list ? list_word(value) : "";
}

/// A value as its option's type; none if it is of another. @throw InputError naming option, value
/// and rule.
FieldValue value_from(const FieldSpec& spec, py::handle value) {
  if (spec.kind == FieldKind::kFlag) {
    return is_bool(value) ? FieldValue(value.cast<bool>()) : FieldValue();
  }
  if (spec.kind == FieldKind::kWhole) {
    return is_whole(value) ? number_value(spec, value) : FieldValue();
  }
  if (spec.is_number() && is_number(value)) return number_value(spec, value);
  const std::string text = text_of(spec, value);
  return text.empty() ? FieldValue() : value_of(spec, text);
}

}  // namespace

Keywords::Keywords(std::string function, const Description& fields,
                   const std::set<std::string>& withheld, Defaults defaults)
    : function_(std::move(function)) {
  app::OptionSet options(function_, "");
  options.add(fields);
  const app::CommonOptions common_defaults;
  defaults_ = {{"--threads", std::to_string(common_defaults.threads)},
               {"--device", common_defaults.device}};
  for (const Field& field : fields) {
    const bool shown = field.kind != FieldKind::kFlag && defaults == Defaults::kOwn;
    if (shown) defaults_[field.name] = value_text(field.get());
  }
  try {
    options.parse({app::kListOptions});
  } catch (const app::ListedOptions& listed) {
    specs_ = listed.options;
  }
  static const std::set<std::string> common{"--json", "--quiet",    "--config",
                                            "--help", "--help-all", "--version"};
  std::erase_if(specs_, [&](const FieldSpec& spec) {
    return !spec.name.starts_with("--") || common.contains(spec.name) ||
           withheld.contains(spec.name);
  });
}

const FieldSpec& Keywords::spec_of(const std::string& keyword) const {
  const auto found = std::find_if(specs_.begin(), specs_.end(), [&](const FieldSpec& spec) {
    return keyword_of(spec.name) == keyword;
  });
  if (found == specs_.end()) {
    throw py::type_error(function_ + "() got an unexpected keyword argument '" + keyword +
                         "'; help(lensforge." + function_ + ") lists them");
  }
  return *found;
}

app::OptionValues Keywords::values(const py::dict& given) const {
  app::OptionValues values;
  for (const auto& [key, value] : given) {
    const auto keyword = key.cast<std::string>();
    FieldSpec spec = spec_of(keyword);
    const std::string option = std::exchange(spec.name, keyword);
    const FieldValue taken = value_from(spec, value);
    if (std::holds_alternative<std::monostate>(taken)) {
      throw py::type_error(function_ + "(): " + keyword + "=" +
                           py::repr(value).cast<std::string>() + ": must be " + python_type(spec));
    }
    // A flag that is off counts as not given.
    if (taken != FieldValue(false)) values[option] = taken;
  }
  return values;
}

std::string Keywords::text() const {
  std::string text;
  for (const FieldSpec& spec : specs_) {
    const auto found = defaults_.find(spec.name);
    text += docstring_line(spec, found == defaults_.end() ? "" : found->second);
  }
  return text;
}

}  // namespace lensforge::python
