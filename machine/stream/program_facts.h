// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/guard/register_map.h"
#include "machine/planner/planner_model.h"
#include "machine/stream/controller_dialogue.h"

namespace lensforge {

/// Lines with a common property.
struct MarkedLines {
  std::int64_t count = 0;
  std::int64_t first = 0;  ///< From 1; 0 for none.

  void add(std::int64_t line) {
    if (count++ == 0) first = line;
  }
};

/// Facts about a whole program. Coordinates in mm: machine coordinates if the start state has the
/// origins of the coordinate systems, else the program's own.
struct ProgramFacts {
  std::int64_t lines = 0;       ///< Lines of the file.
  std::int64_t sent_lines = 0;  ///< Lines that are sent.
  std::int64_t sent_bytes = 0;  ///< Their bytes, with line ends, without N words.
  std::int64_t motions = 0;
  bool inches = false;             ///< The program uses G20.
  Eigen::AlignedBox3d extent;      ///< Box of all motions.
  Eigen::AlignedBox3d cut_extent;  ///< Box of the motions at feed.
  double top_feed = 0.0;           ///< mm/min
  std::int64_t top_feed_line = 0;
  double top_rpm = 0.0;
  std::int64_t top_rpm_line = 0;
  double least_rpm = std::numeric_limits<double>::infinity();  ///< Lowest nonzero speed.
  std::optional<double> plunge_feed;  ///< Lowest feed straight down, mm/min.
  double rapid_z = -std::numeric_limits<double>::infinity();  ///< Highest end of a rapid.
  std::int64_t tool_changes = 0;
  std::int64_t pauses = 0;
  MarkedLines unsafe_comments;     ///< GcodeText::unsafe_comment
  MarkedLines bare_circles;        ///< GcodeEffect::bare_circle
  bool ends = false;               ///< M2, M30 or the second %.
  bool leaves_spindle_on = false;  ///< At the program's end.
  PlanTime time;
};

/// Options for examining a program.
struct FactsOptions {
  GcodeDialect dialect;
  GcodeState start;
  PlannerSettings planner;
  double spin_up = 0.0;  ///< Seconds for each change of the spindle.
};

/// Reads and interprets every line of a program, in constant memory. @throw GcodeError for the
/// first line that the dialect or the sender refuses, also for cutting with the spindle off;
/// Interrupted; RunError if the file cannot be read.
ProgramFacts examine_program(std::istream& in, const FactsOptions& options,
                             const RunControl& control);

/// Objections to a job, in plain sentences.
struct Findings {
  std::vector<std::string> refusals;  ///< The job must not start.
  std::vector<std::string> warnings;  ///< For the operator.
};

/// Identity of a job's program, by content: the name does not matter.
struct JobIdentity {
  std::string sha256;      ///< Hash of the whole file, 64 hexadecimal digits.
  std::int64_t bytes = 0;  ///< Its size.
  std::string name;        ///< File name without folder, for display only.

  [[nodiscard]] bool same_program(const JobIdentity& other) const {
    return sha256 == other.sha256 && bytes == other.bytes;
  }
};

/// Progress of a job. Lines are those of the file, counted from 1; 0 before the first.
struct JobProgress {
  std::int64_t sent = 0;                    ///< Last line that was sent, in part or whole.
  std::int64_t acknowledged = 0;            ///< Every line up to this one was accepted.
  std::int64_t executed = 0;                ///< At least every line up to this one was executed.
  std::int64_t byte = 0;                    ///< Offset in the file after the acknowledged line.
  std::string state;                        ///< The controller's last state: "Run", "Hold" …
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  std::string spindle;                      ///< Its state, in a word.
  double rpm = 0.0;                         ///< Last reading.
};

/// Origins of G54 … G59, machine coordinates, mm.
using WorkOrigins = std::array<Eigen::Vector3d, 6>;

/// Content of a journal: bounds on what the sender has done.
struct JournalRecord {
  JobIdentity job;
  bool finished = false;  ///< The program reached its end.
  std::string status;     ///< Status of the last run; empty if it ended without one.
  std::string reason;     ///< Reason for that status.
  JobProgress last;  ///< From the last record with progress; sent, acknowledged and executed are
                     ///< the maxima over all runs, and sent includes reserved lines.
  std::optional<WorkOrigins> origins;  ///< At the job's start.
  std::int64_t runs = 0;               ///< Number of starts and resumptions of the job.
  std::int64_t bytes = 0;              ///< Length of the valid part of the file.
  std::int64_t torn = 0;               ///< Number of bytes after it: a truncated record.
};

struct ProgramPieces;

/// A program that is read once when opened; later reads return the same bytes or fail. If the file
/// is replaced, overwritten, truncated or extended meanwhile, nothing is checked or sent that does
/// not belong to identity().
///
/// Each piece of 64 KiB is hashed at the first reading and again whenever it is read; the hashes
/// take 1/2000 of the file's size in memory.
class ProgramFile {
 public:
  /// @throw InputError naming the path if it is missing, is no regular file or cannot be read;
  ///        Interrupted
  explicit ProgramFile(const std::filesystem::path& path, const RunControl& control = {});

  [[nodiscard]] const JobIdentity& identity() const;
  /// Returns a seekable stream of its bytes, independent of this object's life. Reading throws
  /// RunError naming the path if the file has changed.
  [[nodiscard]] std::unique_ptr<std::istream> open() const;

 private:
  std::shared_ptr<const ProgramPieces> pieces_;
};

/// Transfer rate to the controller.
struct StreamRate {
  double bytes_per_second = 0.0;  ///< 0 for no limit.
  double lines_per_second = 0.0;  ///< 0 for no limit.
};

/// The travel allowed by the settings, machine coordinates, mm; empty if homing is off or a travel
/// is not set.
std::optional<Eigen::AlignedBox3d> travel_box(const ControllerInfo& info);

/// Warnings about a program that apply to any controller.
std::vector<std::string> program_warnings(const ProgramFacts& facts);

/// Checks a program's facts against a controller's settings and state. Every refusal names the
/// item, the value and the rule. @param facts  computed with the controller's start state.
Findings check_program(const ProgramFacts& facts, const ControllerInfo& info);

/// Adds findings for programmed speeds outside the range of the register map's spindle.
void check_spindle_range(const ProgramFacts& facts, const std::vector<RegisterMap>& maps,
                         Findings& found);

/// The reason for which a program moves nothing, in a sentence without its name; empty if it moves.
std::string lack_of_motion(const ProgramFacts& facts);

/// Limits of the stream of a program: the serial speed (10 bits per byte), the line rate of an
/// 8-bit board, and, if sent line by line, the round trip. @param baud  0 for no serial line.
/// @param round_trip  s. @param mean_bytes  per line.
StreamRate stream_rate(const ControllerInfo& info, int baud, double round_trip, double mean_bytes);

}  // namespace lensforge
