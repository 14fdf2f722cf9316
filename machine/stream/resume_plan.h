// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <istream>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/program_feed.h"

namespace lensforge {

/// Options for resuming a job. Lengths in mm.
struct ResumeOptions {
  std::int64_t margin = 20;  ///< Minimum number of executed lines to cut again.
  /// Length of already cut path over which the tool descends onto it.
  double ramp = 2.0;
  double lift = 0.3;          ///< Height above the path at which the ramp begins.
  double plunge_feed = 60.0;  ///< Used if the program has no feed straight down, mm/min.
};

/// Plan for resuming a job: the sender's own lines, then the program from a given line.
struct ResumePlan {
  std::int64_t line = 1;         ///< First line of the program that is sent.
  std::int64_t offset = 0;       ///< Its offset in the file.
  GcodeState state;              ///< State before it, with the tool at the end of the ramp.
  std::int64_t entry_line = 1;   ///< First line that is cut again, at least in part.
  std::int64_t overlap_end = 0;  ///< Last line that may be cut twice, at least in part.
  std::deque<OutgoingLine> before;
  std::vector<std::string> steps;  ///< `before` in plain sentences, for the operator.
};

/// Plans how to continue after `record`, at least `margin` lines before the last executed one. The
/// tool rises to its current (homed) height, moves over the entry, descends at feed to just above
/// the path, and follows the already cut path while its height above it falls to zero with zero
/// slope, which leaves no mark. If the path does not allow that, the program's own approach is
/// repeated.
/// @param info  of the homed machine, whose Z is the retract height.
/// @throw InputError if the job is finished, or the coordinate origin has moved since.
ResumePlan plan_resume(std::istream& program, const JournalRecord& record,
                       const ControllerInfo& info, const ProgramFacts& facts,
                       const ResumeOptions& options);

/// Input for a safe re-entry into a program.
struct PathEntry {
  const std::vector<GcodeMotion>&
      path;                 ///< Path of the descent; empty: straight down to the tool's place.
  const GcodeState& state;  ///< State at the re-entry, with the tool's place.
  const ControllerInfo& info;
  const ProgramFacts& facts;
  const ResumeOptions& options;
};

/// Returns the lines that bring a homed machine to the entry: modes, up, spindle, coolant, over,
/// down, along, modes of the program. In the program's unit. @param line, offset  position in the
/// program that they are assigned to.
std::deque<OutgoingLine> entry_lines(const PathEntry& entry, std::int64_t line,
                                     std::int64_t offset);

/// entry_lines() in plain sentences.
std::vector<std::string> entry_steps(const PathEntry& entry);

/// Points above the path; their height above it falls to zero, with zero slope at the path's end.
/// Machine coordinates, mm. The first is the bottom of the plunge, the last the path's end.
std::vector<Eigen::Vector3d> ramp_points(const std::vector<GcodeMotion>& path, double length,
                                         double lift);

/// "X1.5 Y2 Z-0.25"
std::string point_text(const Eigen::Vector3d& point);

}  // namespace lensforge
