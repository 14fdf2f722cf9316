// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/console.h"
#include "app/interruptible_job.h"
#include "app/option_set.h"
#include "core/surface/lens.h"
#include "export/spline_net.h"
#include "export/step_file.h"

namespace lensforge::app {

/// The options that only a solid of splines has.
struct StepArguments {
  FitOptions fit;
  int max_points = 0;
  StepSchema schema = StepSchema::kAp214;
  std::string author;
  bool iges = false;  ///< IGES instead of STEP.
};

void add_step_options(OptionSet& options, StepArguments& arguments);

/// @throw InputError naming an option that was given though `format` has no use for it.
void require_no_step_options(const OptionSet& options, const std::string& format);

/// What was written: for programs, for people, and whether the tolerances hold.
struct StepReport {
  nlohmann::json json;
  std::string text;
  bool within_tolerance = false;
};

/// Fits and writes `lens.surface`. @param source  the file that it was read from.
/// @throw InputError if its outline is no rectangle, or the memory or the disk has no room for so
///        many control points; RunError; Interrupted.
StepReport export_step(const Lens& lens, const std::filesystem::path& source,
                       const std::filesystem::path& out, const StepArguments& arguments,
                       const Executor& executor, InterruptibleJob& job, const Console& console);

}  // namespace lensforge::app
