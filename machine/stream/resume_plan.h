// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <istream>
#include <string>
#include <vector>

#include "core/compute/run_control.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/program_feed.h"

namespace lensforge {

/// How a job is taken up again. Lengths in mm.
struct ResumeOptions {
  std::int64_t margin = 20;  ///< Lines before the last one carried out that are cut again at least.
  /// Length of path, cut before, over which the tool comes down onto it.
  double ramp = 2.0;
  double lift = 0.3;          ///< Height above the path at which the ramp begins.
  double plunge_feed = 60.0;  ///< Where the program has none straight down, mm/min.
};

/// How a job goes on: the sender's own lines, then the program from a line on.
struct ResumePlan {
  std::int64_t line = 1;         ///< First line of the program that is sent.
  std::int64_t offset = 0;       ///< Where it begins in the file.
  GcodeState state;              ///< In force before it, the tool at the end of the ramp.
  std::int64_t entry_line = 1;   ///< First line of whose motion something is cut again.
  std::int64_t overlap_end = 0;  ///< Last line of which something may be cut twice.
  std::deque<OutgoingLine> before;
  std::vector<std::string> steps;  ///< The same for the operator, in plain sentences.
};

/// Plans how to go on after `record`, no later than `margin` lines before the last that was carried
/// out. The tool goes up to where it stands now, over the entry, down above the path at feed, and
/// comes down onto what was cut before along the path itself, its height above it falling to zero
/// with zero slope, so that it leaves no mark. Where the path before does not allow that, the
/// program's own approach is run again.
/// @param info  of the homed machine: its Z is the retract height.
/// @throw InputError if the job is finished, or the coordinate system has moved since.
ResumePlan plan_resume(std::istream& program, const JournalRecord& record,
                       const ControllerInfo& info, const ProgramFacts& facts,
                       const ResumeOptions& options);

/// What a safe re-entry into a program is made from.
struct Entry {
  const std::vector<GcodeMotion>& path;  ///< To come down along; empty: straight down to the tool.
  const GcodeState& state;               ///< In force where the program goes on; the tool's place.
  const ControllerInfo& info;
  const ProgramFacts& facts;
  const ResumeOptions& options;
};

/// Lines that bring a homed machine there: modes, up, spindle, coolant, over, down, along, modes of
/// the program. In the program's unit. @param line, offset  of the program, that they count as.
std::deque<OutgoingLine> entry_lines(const Entry& entry, std::int64_t line, std::int64_t offset);

/// The same in sentences.
std::vector<std::string> entry_steps(const Entry& entry);

/// Points along the path with their height above it falling to zero with zero slope at its end.
/// Machine coordinates, mm. The first is where the tool comes down to, the last the path's end.
std::vector<Eigen::Vector3d> ramp_points(const std::vector<GcodeMotion>& path, double length,
                                         double lift);

/// "X1.5 Y2 Z-0.25"
std::string point_text(const Eigen::Vector3d& point);

}  // namespace lensforge
