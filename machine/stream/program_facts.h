// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <istream>
#include <limits>
#include <optional>
#include <string>

#include "core/compute/executor.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/planner/planner_model.h"

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

}  // namespace lensforge
