// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/register_map.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/program_facts.h"

namespace lensforge {

/// What the way to the controller carries.
struct StreamRate {
  double bytes_per_second = 0.0;  ///< 0 without limit.
  double lines_per_second = 0.0;  ///< Likewise.
};

/// What stands against a job, in plain sentences.
struct Findings {
  std::vector<std::string> refusals;  ///< It must not start.
  std::vector<std::string> warnings;  ///< The operator should know.
};

/// The box that the settings allow, machine coordinates, mm: nothing where homing is off or a
/// travel is not set.
std::optional<Eigen::AlignedBox3d> travel_box(const ControllerInfo& info);

/// What the operator should know of a program, whatever it is sent to.
std::vector<std::string> program_warnings(const ProgramFacts& facts);

/// Sets a program's facts against a controller's settings and state. Every refusal names what, the
/// value and the rule.
/// @param facts  with the controller's start state.
Findings check_program(const ProgramFacts& facts, const ControllerInfo& info);

/// Adds the speeds that a program asks for and a spindle under a register map does not have.
void check_spindle_range(const ProgramFacts& facts, const std::vector<RegisterMap>& maps,
                         Findings& found);

/// What a program that moves nothing lacks, in a sentence without its name; empty if it moves.
std::string lack_of_motion(const ProgramFacts& facts);

/// What the stream of a program is limited by: the serial speed (10 bits a byte), the lines that an
/// 8-bit board digests, and, sent line by line, the way there and back.
/// @param baud  0 for no serial line. @param round_trip  s. @param mean_bytes  of a line.
StreamRate stream_rate(const ControllerInfo& info, int baud, double round_trip, double mean_bytes);

}  // namespace lensforge
