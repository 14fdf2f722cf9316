// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>
#include <vector>

#include "app/frame/option_set.h"

namespace lensforge::python {

namespace py = pybind11;

/// Keyword arguments of a function: the options of the command of the same name, with '_' for '-'
/// and without leading dashes. The command's own parser reads them; limits, defaults and error
/// messages are the same.
class Keywords {
 public:
  /// @param add       adds the command's options to a set.
  /// @param withheld  options that the function does not take, such as "--out".
  template <class Settings>
  static Keywords of(const std::string& function, void (*add)(app::OptionSet&, Settings&),
                     const std::set<std::string>& withheld) {
    Settings defaults;
    app::OptionSet options(function, "");
    add(options, defaults);
    return {function, options, withheld};
  }

  /// Converts keywords to the words of a command line.
  /// @throw TypeError (Python's) naming function and keyword for an unknown keyword or a value of
  ///        the wrong type.
  [[nodiscard]] app::Arguments words(const py::kwargs& given) const;

  /// Describes the keywords and their values, for a docstring.
  [[nodiscard]] std::string text() const;

 private:
  Keywords(std::string function, app::OptionSet& options, const std::set<std::string>& withheld);

  [[nodiscard]] const FieldSpec& spec_of(const std::string& keyword) const;

  std::string function_;
  std::vector<FieldSpec> specs_;
};

}  // namespace lensforge::python
