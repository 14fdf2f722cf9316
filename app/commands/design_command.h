// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "cam/plan/cam_options.h"
#include "core/compute/run_control.h"
#include "core/image/background.h"
#include "core/image/image_io.h"
#include "design/design_lens.h"
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

/// What an output folder holds of an earlier design.
struct EarlierDesign {
  bool lens = false;        ///< A lens.json: of a finished or an interrupted design.
  bool checkpoint = false;  ///< Something to go on from.
  /// Files with names that `design` writes, which lensforge did not write.
  std::vector<std::string> foreign;
  nlohmann::json provenance;  ///< Of the lens; null where there is none.

  static EarlierDesign in(const std::filesystem::path& folder);

  /// Whether the lens is of the design with this fingerprint, finished or not.
  [[nodiscard]] bool is_of(const std::string& fingerprint) const;

  friend bool operator==(const EarlierDesign&, const EarlierDesign&) = default;
};

/// @throw InputError if `folder` holds something that the design would replace and neither `resume`
///        nor `force` says that it may; or, whatever they say, a folder or device in the place of a
///        file.
void refuse_to_overwrite(const std::filesystem::path& folder, const EarlierDesign& earlier,
                         bool resume, bool force);

/// Where a lens comes from: program, options, time, outcome.
nlohmann::json design_provenance(const OptionSet& options, const ChosenDevice& device,
                                 const DesignOptions& design, const DesignResult& result);

/// Writes all that a design leaves in its folder, and puts it in the place of what was there. The
/// cut of an earlier lens goes with it: milled, it would not be this one.
/// @throw RunError if something cannot be written.
void write_design(const std::filesystem::path& folder, const DesignResult& result,
                  const Console& console);

}  // namespace lensforge::app
