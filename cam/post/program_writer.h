// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "cam/path/operation.h"
#include "cam/post/post_description.h"
#include "cam/post/program_reader.h"
#include "cam/workshop/tool.h"
#include "core/compute/executor.h"
#include "core/io/files.h"
#include "machine/planner/planner_model.h"

namespace lensforge {

/// One operation of a cut: a tool and its moves.
struct ProgramOperation {
  std::string name;  ///< "rough", "finish": names its file.
  Tool tool;
  std::vector<std::string> comments;  ///< Below its heading in the program.
  /// Streams the moves, lens frame. The tool is at the safe height beforehand and is brought back
  /// there afterwards. A first move at feed is a point to plunge to; it must not be an arc. An
  /// operation that is not complete() was interrupted.
  std::function<OperationSummary(const MoveSink&)> stream;
};

/// A whole cut to be written.
struct ProgramPlan {
  std::string job = "lens";           ///< In the first comment and for {job}.
  std::vector<std::string> comments;  ///< Of the header: units, zero, blank.
  std::vector<ProgramOperation> operations;
  double z_offset = 0.0;  ///< Program Z = lens-frame z + z_offset, mm.
  double safe_z = 5.0;    ///< Z of the retracts between operations, program frame, mm.
};

/// Receives every line of every program as it was read back, in the order in which they are run,
/// with the plan's index of its operation. A program begins with its line 1.
using ReadBackSink = std::function<void(std::size_t operation, const ProgramLine& line)>;

/// Settings for writing a plan.
struct ProgramSettings {
  int decimals = 5;  ///< Of coordinates, 0 … the dialect's maximum.
  /// Maximum distance by which LinuxCNC may cut corners to keep its feed, mm; without a limit it
  /// keeps the feed at any distance. 0 leaves the machine's setting; dialects without the word
  /// ignore it.
  double blend_tolerance = 0.0;
  double chord_tolerance = 5e-4;  ///< Of chords where the dialect has no such arc, mm, > 0.
  double spin_up = 3.0;           ///< Dwell after the spindle was switched on, s, ≥ 0.
  /// The operator switches the spindle, not the program, which pauses (M0) for it instead.
  bool spindle_by_hand = false;
  Coolant coolant = Coolant::kOff;
  ProgramGrouping grouping = ProgramGrouping::kOperation;
  std::uintmax_t largest_file = 0;  ///< Bytes, ≥ 65536; 0 for the dialect's own limit, if any.
  PlannerSettings planner;          ///< Of the machine, for the time; see planner_settings().
  double tool_change = 30.0;        ///< Seconds for M6.
  ReadBackSink look = {};
};

/// Minimum of ProgramSettings::largest_file, bytes: head, end and one long arc fit.
inline constexpr std::uintmax_t kSmallestProgramLimit = 1 << 16;

/// An operation, or its part in one file.
struct OperationTime {
  std::size_t operation = 0;  ///< Index in the plan.
  std::int64_t line = 0;      ///< Where it begins in the file; 0 for a whole operation.
  std::int64_t end = std::numeric_limits<std::int64_t>::max();  ///< The next one's first line.
  ProgramTime time;
};

/// One program file as it was read back.
struct WrittenProgram {
  std::filesystem::path path;
  std::filesystem::path beside;  ///< Path until published; empty afterwards.
  std::uintmax_t bytes = 0;
  std::string sha256;  ///< Of everything below the seal line, as its header states.
  ProgramReading reading;
  ProgramTime time;
  std::vector<OperationTime> operations;
};

/// Result of a plan.
struct ProgramFiles {
  std::vector<WrittenProgram> files;        ///< In the order in which they are to be run.
  GcodeDialect reader;                      ///< Dialect used to read them back.
  std::vector<OperationSummary> summaries;  ///< Of the plan's operations.
  std::vector<ProgramTime> times;           ///< The same, over all files.
  std::vector<std::string> names;           ///< Of all files that were read back, in that order.
  ProgramTime total;
};

/// Writes a plan as programs of the dialect, streamed to disk in constant memory. Each file is a
/// complete program: header with job, tools, extents, minutes and a hash of what follows; modes;
/// retract to the safe height; tool; spindle; the motions; retract, spindle off, end. A file that
/// would exceed the size limit is split (finish_1.ngc, finish_2.ngc), at a rapid if one comes in
/// the last tenth; the next file then plunges at the tool's plunge feed to where the cut stopped.
///
/// Every file is read back by our own parser: its motions at feed must be those written, to the
/// last decimal. No file has its name before publish().
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
  std::vector<PendingFile> pending_;  ///< One per file.
};

/// Existing files in `folder` under names that a plan's programs, or parts of them, may get.
std::vector<std::filesystem::path> programs_in_the_way(const ProgramPlan& plan,
                                                       const PostDescription& post,
                                                       const ProgramSettings& settings,
                                                       const std::filesystem::path& folder);

/// Maximum spin-up or tool change, s.
inline constexpr double kMaxPause = 3600.0;

/// The options --spin-up and --coolant.
void describe_spindle_start(Description& d, double& spin_up, Coolant& coolant);

/// @throw InputError naming what, value and rule.
void validate(const ProgramSettings& settings, const PostDescription& post);

}  // namespace lensforge
