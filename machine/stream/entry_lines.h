// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "machine/gcode/gcode_motion.h"
#include "machine/stream/resume_plan.h"

namespace lensforge {

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
