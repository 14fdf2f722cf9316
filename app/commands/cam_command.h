// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/frame/option_set.h"
#include "cam/cam.h"
#include "cam/plan/cam_options.h"
#include "cam/report/verdict.h"
#include "core/io/lens_folder.h"

namespace lensforge::app {

/// Options of `lensforge cam`.
struct CamSettings {
  std::string source;
  std::string workshop;  ///< TOML file; empty for the defaults.
  bool show_workshop = false;
  std::vector<std::string> compare;  ///< Items to compare; empty: make programs.
  CamOptions cam;

  /// DIR/cam, for a front DIR/cam-front.
  [[nodiscard]] std::filesystem::path folder() const {
    const bool front = cam.face == CutFace::kFront;
    return std::filesystem::path(source) / (front ? lens_file::kFrontCut : lens_file::kCut);
  }
};

/// Returns a folder's own name, also for "." or a path with a trailing slash.
std::string folder_name(const std::filesystem::path& folder);

/// Describes every option of the command.
void describe(Description& d, CamSettings& settings);

/// Overrides the workshop file with the given options. @throw InputError naming file or option,
/// value and rule.
void settle(OptionSet& options, CamSettings& settings);

/// Reads a workshop file, if one is named, and overrides it with the options given.
/// @throw InputError naming the file, key, value and rule.
void take_workshop(OptionSet& options, const std::string& file, CamOptions& cam);

/// Checks the workshop after its options were given. @throw InputError naming file or option,
/// value and rule.
void check_workshop(const std::string& file, const CamOptions& cam);

/// What both commands print of a job as JSON: status, message, warnings, options, files.
nlohmann::json job_json(const OptionSet& options, const JobResult& result,
                        const std::vector<std::string>& warnings);

/// The programs' zero along Z in the lens frame, as a line.
std::string z_text(double z_offset);

/// Returns one line for every limit that a cut misses and for every piece of advice.
std::string verdict_text(const Verdict& verdict);

/// Last note of a finished job: the page or drawing to look at. If no limit is missed, also its
/// first program: the command that checks it, where `lensforge send` takes the dialect.
std::string next_step(const std::filesystem::path& page, const JobResult& job,
                      const CamOptions& cam, int missed);

// Several lenses on one blank.

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
