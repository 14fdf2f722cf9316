// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "app/frame/option_set.h"
#include "cam/cam.h"

namespace lensforge::app {

/// What `lensforge nest` was asked for.
struct NestSettings {
  /// Unless it is told otherwise, every lens is cut out: rectangles come apart, too.
  NestSettings() { nest.cam.cut_outline = OutlineWish::kAlways; }

  std::vector<std::string> sources;  ///< Lens folders; one named twice is cut twice.
  std::string out;
  std::string workshop;  ///< TOML file; empty for the defaults.
  NestOptions nest;
};

/// Adds every option of the command.
void add_nest_options(OptionSet& options, NestSettings& settings);

/// Puts what was given over the workshop file. @throw InputError naming file or option, value and
/// rule.
void settle(OptionSet& options, NestSettings& settings);

/// Names of the sources' folders; what comes again has its number behind it: "bee", "bee_2".
std::vector<std::string> nest_names(const std::vector<std::string>& sources);

}  // namespace lensforge::app
