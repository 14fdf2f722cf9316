// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <deque>
#include <istream>
#include <optional>
#include <string>

#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {

/// Spindle command of a line.
struct SpindleOrder {
  SpindleTurn turn = SpindleTurn::kOff;
  double rpm = 0.0;

  [[nodiscard]] bool turning() const { return turn != SpindleTurn::kOff && rpm > 0.0; }
  bool operator==(const SpindleOrder&) const = default;
};

/// A line to be sent, with the properties that the sender needs.
struct OutgoingLine {
  std::string text;              ///< As sent, without its end.
  std::int64_t line = 0;         ///< In the file; for the sender's own lines, the line before.
  std::int64_t next_offset = 0;  ///< Offset of the next byte in the file.
  bool numbered = false;         ///< Has an N word that identifies `line`.
  bool cuts = false;             ///< Moves at feed.
  double travel = 0.0;           ///< Largest travel of one axis, mm.
  double dwell = 0.0;            ///< G4, s.
  /// The machine is at rest, with everything executed, from before it is sent until it is answered.
  bool barrier = false;
  /// The line makes the controller access its stored settings, during which an 8-bit board loses
  /// bytes: nothing else may be in transit.
  bool alone = false;
  std::optional<SpindleOrder> spindle;  ///< Set if it changes.
  bool tool_change = false;             ///< M6
  bool pauses = false;                  ///< M0, M1
  bool ends = false;                    ///< M2, M30
};

/// Options for preparing lines.
struct FeedOptions {
  GcodeDialect dialect;
  bool number_lines = false;  ///< Give each line our own N word if it fits.
  GcodeState start;           ///< Tool position and active modes at the first line.
  std::int64_t first_line = 1;
  std::int64_t first_offset = 0;    ///< Offset of first_line.
  std::deque<OutgoingLine> before;  ///< The sender's own lines before the first.
};

/// Converts a program to the lines to be sent: compacted, numbered, with added_words(); blank lines
/// and comments are dropped. Constant memory.
class ProgramFeed {
 public:
  /// @param in  must outlive the feed; seekable unless the feed starts at the first line.
  ProgramFeed(std::istream& in, FeedOptions options);

  /// Returns the next line to send; empty after the end of the program.
  /// @throw GcodeError if a line is refused; RunError if the file cannot be read.
  std::optional<OutgoingLine> next();

  /// N words run from 1 to the dialect's largest, then start again at 1.
  static std::int64_t number_of(std::int64_t line, std::int64_t largest) {
    return (line - 1) % largest + 1;
  }

 private:
  std::optional<OutgoingLine> made_ready(const GcodeText& text);
  void note_effect(const GcodeEffect& effect, const GcodeState& before, OutgoingLine& line) const;

  FeedOptions options_;
  GcodeReader reader_;
  GcodeInterpreter interpreter_;
  bool first_ = true;
};

/// Words added to a line that the Grbl family would otherwise refuse: for a circle without
/// coordinates, its end point, which is the tool's position. @param after  state after the line.
std::string added_words(const GcodeEffect& effect, const GcodeState& after);

/// The spindle command of a state.
SpindleOrder spindle_order(const GcodeState& state);

}  // namespace lensforge
