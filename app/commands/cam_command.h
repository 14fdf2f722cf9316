// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/frame/option_set.h"
#include "cam/plan/cam_options.h"
#include "cam/report/verdict.h"

namespace lensforge::app {

/// What `lensforge cam` was asked for.
struct CamSettings {
  std::string source;
  std::string workshop;  ///< TOML file; empty for the defaults.
  bool show_workshop = false;
  std::vector<std::string> compare;  ///< What to compare; empty: make programs.
  CamOptions cam;

  /// DIR/cam
  [[nodiscard]] std::filesystem::path folder() const {
    return std::filesystem::path(source) / "cam";
  }
};

/// What a folder is called, also where it is named as "." or with a slash behind it.
std::string folder_name(const std::filesystem::path& folder);

/// Adds every option of the command.
void add_cam_options(OptionSet& options, CamSettings& settings);

/// Puts what was given over the workshop file. @throw InputError naming file or option, value and
/// rule.
void settle(OptionSet& options, CamSettings& settings);

/// A line for every limit that a cut misses, and for what is advice.
std::string verdict_text(const Verdict& verdict);

}  // namespace lensforge::app
