// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/frame/option_set.h"

namespace lensforge::python {

namespace py = pybind11;

/// Keyword arguments of a function: the options of the command of the same name, with '_' for '-'
/// and without leading dashes. Limits and defaults are those of the options' descriptions.
class Keywords {
 public:
  enum class Defaults {
    kOwn,      ///< The fields' values.
    kOfALens,  ///< A lens's, which the fields' values are not.
  };

  /// @param fields    the command's options.
  /// @param withheld  options that the function does not take, such as "--out".
  Keywords(std::string function, const Description& fields, const std::set<std::string>& withheld,
           Defaults defaults = Defaults::kOwn);

  /// The values of the options.
  /// @throw TypeError (Python's) naming function and keyword for an unknown keyword or a value of
  ///        the wrong type; InputError naming keyword, value and rule.
  [[nodiscard]] app::OptionValues values(const py::dict& given) const;

  /// Describes the keywords, their values and defaults, for a docstring.
  [[nodiscard]] std::string text() const;

 private:
  [[nodiscard]] const FieldSpec& spec_of(const std::string& keyword) const;

  std::string function_;
  std::vector<FieldSpec> specs_;
  std::map<std::string, std::string> defaults_;  ///< By option; empty texts where there is none.
};

}  // namespace lensforge::python
