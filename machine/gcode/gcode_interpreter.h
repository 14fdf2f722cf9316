// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {

inline constexpr double kMillimetresPerInch = 25.4;

/// Actions of one line, in this order: tool, spindle, dwell, motions, stop.
class GcodeEffect {
 public:
  std::optional<int> tool_change;  ///< M6, with the tool.
  bool spindle_changed = false;    ///< The line has M3, M4, M5 or S, even if nothing changes.
  double dwell = 0.0;              ///< G4, s.
  bool pauses = false;             ///< M0
  bool ends = false;               ///< M2, M30, or the second %.
  /// An arc whose line states no coordinate in its plane: a full circle around I J K. The Grbl
  /// family requires the end point.
  bool bare_circle = false;

  /// None, one, or two for G28 and G30 via a point.
  [[nodiscard]] std::span<const GcodeMotion> motions() const { return {motions_.data(), size_}; }
  void add(const GcodeMotion& motion) { motions_[size_++] = motion; }

 private:
  std::array<GcodeMotion, 2> motions_;
  std::size_t size_ = 0;
};

/// Interprets a program like a Grbl-family controller, but more strictly.
///
/// Known: G0 G1 G2 G3 G80, G4, G17 G18 G19, G20 G21, G28 G30, G40 G49 G61, G53, G54 … G59, G90 G91,
/// G91.1, G93 G94, M0 M1 M2 M30, M3 M4 M5, M7 M8 M9, F, S, T; if the dialect has them, M6, G43 with
/// H (coordinates stay those of the tip), G43.1 with Z (which moves the coordinates' origin), G64
/// with P, G61.1, G5.1 with Q and a leading O word. Refused in addition to unknown words: two words
/// of one group, a motion before G20 or G21, before a feed or without its coordinates, words that
/// nothing uses, words after the end of the program, words that change the controller's stored
/// offsets (G10, G28.1, G30.1, G92), lines too long for the dialect.
class GcodeInterpreter {
 public:
  /// @param start  the tool's position and the active modes; by default those after a reset.
  explicit GcodeInterpreter(const GcodeDialect& dialect, const GcodeState& start = {});

  /// Runs one line. @throw GcodeError; the state is then unchanged.
  GcodeEffect run(const GcodeBlock& block);

  /// Refuses a line that is longer, as sent, than the dialect's buffer. @param added  number of
  /// characters that the sender adds, including an N word that replaces the line's own.
  /// @throw GcodeError
  void check_length(const GcodeText& text, std::size_t added) const;

  [[nodiscard]] const GcodeState& state() const { return state_; }
  /// M2, M30 or the second % was run.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  void run_percent(const GcodeBlock& block, GcodeEffect& effect);

  GcodeDialect dialect_;
  GcodeState state_;
  int percents_ = 0;
  bool begun_ = false;
  bool ended_ = false;
};

}  // namespace lensforge
