// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/option_set.h"
#include "cam/cam_options.h"
#include "core/surface/surface_model.h"

namespace lensforge::app {

/// What `lensforge cam` was asked for. Numbers that belong to the workshop stand here with its
/// defaults and overrule it only where the command line or --config gave them.
struct CamSettings {
  std::string source;
  std::string workshop;  ///< TOML file; empty for the defaults.
  bool show_workshop = false;
  std::string post;  ///< NAME|FILE.toml
  double split_mb = 0.0;
  double rough_tool = 0.0;  ///< Diameter, mm.
  bool no_rough = false;
  bool no_semi = false;
  bool no_arcs = false;
  bool no_render = false;
  std::vector<std::string> compare;     ///< What to compare; empty: make programs.
  std::optional<SurfaceModel> surface;  ///< To cut; none: the model of the design.
  Tool finish_tool;
  Process process;
  Stock stock;
  CamOptions cam;

  /// DIR/cam
  [[nodiscard]] std::filesystem::path folder() const {
    return std::filesystem::path(source) / "cam";
  }
};

/// Adds every option of the command.
void add_cam_options(OptionSet& options, CamSettings& settings);

/// The options of the stage: the workshop file's content under what was given.
/// @throw InputError naming file or option, value and rule.
CamOptions cam_options(const OptionSet& options, const CamSettings& settings);

}  // namespace lensforge::app
