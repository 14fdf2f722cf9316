// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>
#include <vector>

#include "app/frame/option_set.h"

namespace lensforge::python {

namespace py = pybind11;

/// The options that a function takes as keywords: those of the command of the same name, with '_'
/// for '-' and without dashes in front. The command's own parser reads them, so that limits,
/// defaults and the words of errors are the same.
class Keywords {
 public:
  /// @param add       adds the command's options to a set.
  /// @param withheld  those that a function has no use for, "--out".
  template <class Settings>
  static Keywords of(const std::string& function, void (*add)(app::OptionSet&, Settings&),
                     const std::set<std::string>& withheld) {
    Settings defaults;
    app::OptionSet options(function, "");
    add(options, defaults);
    return {function, options, withheld};
  }

  /// The words of a command line.
  /// @throw TypeError (Python's) naming function and keyword for an unknown one, or for a value
  ///        that is none of its kind.
  [[nodiscard]] app::Arguments words(const py::kwargs& given) const;

  /// What each is and which values it takes, for a docstring.
  [[nodiscard]] std::string text() const;

 private:
  Keywords(std::string function, app::OptionSet& options, const std::set<std::string>& withheld);

  [[nodiscard]] const OptionSpec& spec_of(const std::string& keyword) const;

  std::string function_;
  std::vector<OptionSpec> specs_;
};

}  // namespace lensforge::python
