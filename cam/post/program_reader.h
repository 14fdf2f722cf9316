// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "machine/gcode/gcode_interpreter.h"
#include "machine/planner/planner_model.h"

namespace lensforge {

/// One line of a program and its effect.
struct ProgramLine {
  const GcodeBlock& block;
  const GcodeEffect& effect;
  const GcodeState& state;  ///< After the line.
  std::size_t bytes = 0;    ///< As sent, without blanks and comments, with its end; 0 for nothing.
};

using LineSink = std::function<void(const ProgramLine&)>;

/// Passes every line of a program to `sink`, in constant memory. G28 and G30 are taken to go to Z
/// 100 mm above X0 Y0: their true target is known only to the machine.
/// @throw InputError naming file, line and reason for the first line that the dialect refuses, that
///        is too long for it, or that cuts with the spindle off or at an unknown height, and for a
///        program without an end or with motions that are not in millimetres; Interrupted; RunError
///        if the file cannot be read.
void walk_program(const std::filesystem::path& path, const GcodeDialect& dialect,
                  const LineSink& sink, const RunControl& control);

/// Totals of a program; program coordinates, mm. Motions by G28 and G30 are not counted.
struct ProgramReading {
  Eigen::AlignedBox3d cutting;  ///< Of all motions at feed, arcs over their whole length.
  double cutting_length = 0.0;
  double rapid_length = 0.0;
  std::int64_t lines = 0;
  std::int64_t motions = 0;
  std::int64_t arcs = 0;
  std::vector<int> tools;   ///< In the order of first use; empty if none is named.
  double least_feed = 0.0;  ///< mm/min; 0 without a motion at feed.
  double most_feed = 0.0;
  std::optional<double> blending;  ///< G64 P in force at the last motion at feed, mm.
  std::optional<bool> seal_holds;  ///< machine/gcode/program_seal.h; nothing without a seal.
};

/// Collects a reading line by line.
class ReadingCollector {
 public:
  void take(const ProgramLine& line);
  [[nodiscard]] const ProgramReading& reading() const { return reading_; }

 private:
  void take_motion(const GcodeMotion& motion);

  ProgramReading reading_;
};

/// Takes the motions of a program, one by one; `tool` is the number of the last T word, or 0.
using MotionSink = std::function<void(const GcodeMotion& motion, int tool)>;

/// Streams all motions of a program to `sink`, in constant memory. Motions by G28 and G30 are left
/// out, so a motion may start elsewhere than where the one before it ended.
/// @throw as walk_program()
ProgramReading read_program(const std::filesystem::path& path, const GcodeDialect& dialect,
                            const MotionSink& sink, const RunControl& control);

/// Time of a stretch of a program, and its load on the controller and the link.
struct ProgramTime {
  double seconds = 0.0;  ///< If lines are always there in time.
  /// If lines come no faster than PlannerSettings::lines_per_second and bytes_per_second.
  double stream_limited_seconds = 0.0;
  std::int64_t lines = 0;    ///< Lines with motion.
  std::int64_t blocks = 0;   ///< Of the planner; chords of arcs count one by one.
  std::int64_t starved = 0;  ///< Times that the limited stream let the queue run empty.
  /// Maximum lines per second over as many lines as the queue holds, at the speeds that the machine
  /// reaches, and its place.
  double peak_lines_per_second = 0.0;
  std::int64_t peak_line = 0;

  /// Adds another stretch; of rates the larger is kept.
  ProgramTime& operator+=(const ProgramTime& other);
};

/// The planner's settings for a machine of the workshop.
PlannerSettings planner_settings(const Machine& machine);

/// Times a program line by line with the model of machine/planner: axis-limited speeds and
/// accelerations, junction deviation, a finite look-ahead; not length ÷ feed. Constant memory.
class ProgramTimer {
 public:
  /// @param tool_change  seconds for M6.
  ProgramTimer(const PlannerSettings& settings, double tool_change);

  void take(const ProgramLine& line);
  /// Time of all lines so far, with the machine stopped at the end. Nothing may follow.
  [[nodiscard]] ProgramTime finish();

 private:
  PlannerModel model_;
  double tool_change_;
  ProgramTime time_;
};

}  // namespace lensforge
