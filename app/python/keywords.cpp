// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/python/keywords.h"

#include <algorithm>
#include <utility>

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

/// "1.5,2": several numbers are one text.
std::string list_word(py::handle values) {
  std::string text;
  for (const py::handle value : values) {
    if (!is_number(value)) return {};
    if (!text.empty()) text += ",";
    text += number_word(value);
  }
  return text;
}

/// A value as a word of the command line; empty if it is none of the option's kind.
std::string word_of(const FieldSpec& spec, py::handle value) {
  switch (spec.kind) {
    case FieldKind::kWhole:
      return is_whole(value) ? number_word(value) : "";
    case FieldKind::kNumber:
      return is_number(value) ? number_word(value) : "";
    case FieldKind::kLength:
      if (is_number(value)) return number_word(value);
      break;
    case FieldKind::kText:
      if (!is_text(value) && py::isinstance<py::sequence>(value)) return list_word(value);
      break;
    default:
      break;
  }
  return is_text(value) ? text_word(value) : "";
}

}  // namespace

Keywords::Keywords(std::string function, app::OptionSet& options,
                   const std::set<std::string>& withheld)
    : function_(std::move(function)) {
  try {
    options.parse({app::kListOptions});
  } catch (const app::ListedOptions& listed) {
    specs_ = listed.options;
  }
  static const std::set<std::string> common{"--json", "--quiet", "--config", "--help", "--version"};
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

app::Arguments Keywords::words(const py::kwargs& given) const {
  app::Arguments words;
  for (const auto& [key, value] : given) {
    const auto keyword = key.cast<std::string>();
    const FieldSpec& spec = spec_of(keyword);
    if (spec.kind == FieldKind::kFlag && is_bool(value)) {
      if (value.cast<bool>()) words.push_back(spec.name);
      continue;
    }
    const std::string word = word_of(spec, value);
    if (spec.kind == FieldKind::kFlag || word.empty()) {
      throw py::type_error(function_ + "(): " + keyword + "=" +
                           py::repr(value).cast<std::string>() + ": must be " + python_type(spec));
    }
    words.push_back(spec.name);
    words.back() += "=";
    words.back() += word;
  }
  return words;
}

std::string Keywords::text() const {
  std::string text;
  for (const FieldSpec& spec : specs_) text += docstring_line(spec);
  return text;
}

}  // namespace lensforge::python
