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
