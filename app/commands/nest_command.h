// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "app/frame/option_set.h"
#include "cam/cam.h"

namespace lensforge::app {

/// Options of `lensforge nest`.
struct NestSettings {
  /// By default every lens is cut out, rectangles too.
  NestSettings() { nest.cam.cut_outline = OutlineWish::kAlways; }

  std::vector<std::string> sources;  ///< Lens folders; one named twice is cut twice.
  std::string out;
  std::string workshop;  ///< TOML file; empty for the defaults.
  NestOptions nest;
};

/// Describes every option of the command.
void describe(Description& d, NestSettings& settings);

/// Overrides the workshop file with the given options. @throw InputError naming file or option,
/// value and rule.
void settle(OptionSet& options, NestSettings& settings);

/// Names of the sources' folders; repeated names are numbered: "bee", "bee_2".
std::vector<std::string> nest_names(const std::vector<std::string>& sources);

}  // namespace lensforge::app
