// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "app/option_set.h"
#include "cam/plan/cam_options.h"
#include "core/compute/run_control.h"
#include "core/image/background.h"
#include "core/image/image_io.h"
#include "design/design_options.h"

namespace lensforge::app {

/// What `lensforge design` was asked for.
struct DesignSettings {
  std::string target;
  std::string out;
  std::string source_picture;  ///< File with the source's shape; empty: a disc.
  std::string outline;         ///< Edge of the lens; empty: its rectangle.
  Background background;       ///< Behind target, source's shape and outline.
  std::string made_by;         ///< Workshop file, or "default"; empty: not designed for a process.
  bool robust = false;         ///< For parts that are polished less and more than made_by says.
  CamOptions cut;  ///< What of it is milled for made_by: the part or a mould, its shrinkage.
  DesignOptions design;
  std::vector<std::string> changes;  ///< What was changed of the pictures above, in words.
  std::string live;  ///< Port of a page that shows the design while it runs; empty: none.
  bool resume = false;
  bool force = false;
};

/// Adds every option of the command.
void add_design_options(OptionSet& options, DesignSettings& settings);

/// Reads the picture to project. @throw InputError; Interrupted.
LoadedImage read_target(const DesignSettings& settings, const RunControl& control);

/// What nobody asked for is as the library has it for this picture; pictures that options name are
/// read. @throw InputError naming option or picture, value and rule; Interrupted.
void settle(OptionSet& options, DesignSettings& settings, const Image& picture,
            const RunControl& control);

}  // namespace lensforge::app
