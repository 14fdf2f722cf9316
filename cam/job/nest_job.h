// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cam/job/nest_plan.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// Names of the files that make_nest() writes beside programs and folders of reports.
namespace nest_file {
inline constexpr const char* kLayout = "layout.svg";
inline constexpr const char* kJson = "nest.json";
}  // namespace nest_file

/// One program of the nest.
struct NestProgram {
  std::string file;
  std::vector<int> tools;  ///< In the order of their use; empty where the program names none.
  double minutes = 0.0;
  std::int64_t lines = 0;
};

/// What came out.
struct NestResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::string message;                       ///< Why it ended, in one line.
  std::vector<std::filesystem::path> files;  ///< What was written, programs first.
  NestLayout layout;
  std::vector<NestProgram> programs;  ///< In the order in which they are run.
  int tool_changes = 0;               ///< The first tool counts, too.
  double z_offset = 0.0;              ///< Program Z − lens-frame z, mm.
  std::vector<std::string> warnings;  ///< Of the nest as a whole.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
  [[nodiscard]] bool passes() const;
  /// Limits that are missed, over all lenses.
  [[nodiscard]] int missed() const;
  [[nodiscard]] double minutes() const;
};

/// Makes programs that mill several lenses of one blank with one zero, X0 Y0 in the blank's lower
/// left corner: all of one operation and then all of the next, so that every tool is changed once
/// where one lens needs it once, outlines last of all. A lens's moves are those of its own cut with
/// the margin and the allowance that the nest gives it, shifted
/// (NestJob.MovesAreThoseOfSingleCuts). Writes the programs, layout.svg and nest.json into
/// `folder`, and into a folder of its name below what make_cut() writes of each lens beside
/// programs. All appear in the end or none.
/// @throw InputError naming option or lens, value and rule: the lenses do not fit the blank, or not
///        one blank; as make_cut(). @throw RunError
NestResult make_nest(const std::vector<NestLens>& lenses, const NestOptions& options,
                     const std::filesystem::path& folder, const Executor& executor,
                     const RunControl& control);

/// The layout, programs and verdicts as nest.json has them. @param reports  every lens's whole
/// report, too.
nlohmann::json nest_json(const NestResult& result, bool reports);

/// Whether a file of this name may be one of a nest's own.
bool is_name_of_nest(const std::string& name);

}  // namespace lensforge
