// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cam/path/move.h"
#include "cam/path/operation.h"
#include "cam/tool/tool.h"
#include "machine/planner/planner_model.h"

namespace lensforge {

/// One operation of a cut: a tool and the moves that it makes.
struct ProgramOperation {
  std::string name;  ///< "rough", "finish": names its file.
  Tool tool;
  std::vector<std::string> comments;  ///< Below its heading in the program.
  /// Streams the moves, lens frame. The tool stands at the safe height beforehand and is brought
  /// back there afterwards. A first move at feed is a point that is plunged to; a first move that
  /// is an arc is not allowed. What is not complete() was interrupted.
  std::function<OperationSummary(const MoveSink&)> stream;
};

/// A whole cut as it is to be written.
struct ProgramPlan {
  std::string job = "lens";           ///< In the first comment and for {job}.
  std::vector<std::string> comments;  ///< Of the header: units, zero, blank.
  std::vector<ProgramOperation> operations;
  double z_offset = 0.0;  ///< Program Z = lens-frame z + z_offset, mm.
  double safe_z = 5.0;    ///< Z of the retracts between operations, program frame, mm.
};

/// Which operations share a file. A dialect without tool change never has two tools in one.
enum class ProgramGrouping {
  kOperation,  ///< One file for each name: rough.ngc, finish.ngc.
  kTool,       ///< Operations in a row with one tool, their names joined: finish-pencil.ngc.
  kAll,        ///< One file, named after the job, where the dialect changes tools; else as kTool.
};

enum class Coolant { kOff, kMist, kFlood };

struct ProgramLine;

/// Is shown every line of every program as it was read back, in the order in which they are run,
/// with the index in the plan of the operation that it belongs to. A program begins with its
/// line 1.
using ReadBackSink = std::function<void(std::size_t operation, const ProgramLine& line)>;

/// How a plan is written.
struct ProgramSettings {
  int decimals = 5;  ///< Of coordinates, 0 … the dialect's most.
  /// How far LinuxCNC may cut corners to keep its feed, mm; without a limit it keeps the feed at
  /// any distance. 0 leaves the machine's setting; dialects without the word ignore it.
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

}  // namespace lensforge
