// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "cam/post/post_description.h"
#include "cam/post/program_plan.h"
#include "cam/post/program_reader.h"
#include "cam/post/program_time.h"
#include "core/compute/run_control.h"
#include "core/io/files.h"

namespace lensforge {

/// ProgramSettings::largest_file at least, bytes: head, end and one long arc fit.
inline constexpr std::uintmax_t kSmallestProgramLimit = 1 << 16;

/// An operation, or the share of it that one file holds.
struct OperationTime {
  std::size_t operation = 0;  ///< Index in the plan.
  std::int64_t line = 0;      ///< Where it begins in the file; 0 for a whole operation.
  std::int64_t end = std::numeric_limits<std::int64_t>::max();  ///< The next one's first line.
  ProgramTime time;
};

/// One program file as it was read back.
struct ProgramFile {
  std::filesystem::path path;
  std::filesystem::path beside;  ///< Where it is until it is published; empty afterwards.
  std::uintmax_t bytes = 0;
  std::string sha256;  ///< Of all below the seal line, as its header states.
  ProgramReading reading;
  ProgramTime time;
  std::vector<OperationTime> operations;
};

/// What a plan came to.
struct ProgramFiles {
  std::vector<ProgramFile> files;           ///< In the order in which they are to be run.
  GcodeDialect reader;                      ///< By which they were read back.
  std::vector<OperationSummary> summaries;  ///< Of the plan's operations.
  std::vector<ProgramTime> times;           ///< Likewise, over all files.
  std::vector<std::string> names;           ///< Of all files that were read back, in that order.
  ProgramTime total;
};

/// Writes a plan as programs of the dialect, streamed to disk in constant memory. Each file is a
/// complete program: header with job, tools, extents, minutes and a hash of what follows; modes;
/// retract to the safe height; tool; spindle; the motions; retract, spindle off, end. A file that
/// would grow beyond the size limit is split (finish_1.ngc, finish_2.ngc), at a rapid if one comes
/// in the last tenth; the next file then plunges at the tool's plunge feed to where the cut was
/// left.
///
/// Every file is read back by our own parser: its motions at feed have to be those that were
/// written, to the last decimal. None has its name before publish().
class PendingPrograms {
 public:
  /// @throw InputError naming what, value and rule for bad settings, or a description whose
  ///        programs cannot be read back; Interrupted; RunError if files cannot be written (disk
  ///        full, …).
  PendingPrograms(const ProgramPlan& plan, const PostDescription& post,
                  const ProgramSettings& settings, const std::filesystem::path& folder,
                  const RunControl& control);
  [[nodiscard]] const ProgramFiles& programs() const { return programs_; }
  /// Gives all files their names, one right after the other. @throw RunError
  void publish();

 private:
  ProgramFiles programs_;
  std::vector<PendingFile> pending_;  ///< One a file.
};

/// What stands in `folder` under names that a plan's programs, or parts of them, may get.
std::vector<std::filesystem::path> programs_in_the_way(const ProgramPlan& plan,
                                                       const PostDescription& post,
                                                       const ProgramSettings& settings,
                                                       const std::filesystem::path& folder);

/// Longest spin-up or tool change, s.
inline constexpr double kMaxPause = 3600.0;

/// @throw InputError naming what, value and rule.
void validate(const ProgramSettings& settings, const PostDescription& post);

}  // namespace lensforge
