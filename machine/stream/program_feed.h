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

/// What a line asks of the spindle.
struct SpindleOrder {
  SpindleTurn turn = SpindleTurn::kOff;
  double rpm = 0.0;

  [[nodiscard]] bool turning() const { return turn != SpindleTurn::kOff && rpm > 0.0; }
  bool operator==(const SpindleOrder&) const = default;
};

/// A line on its way to the controller, with what the sender has to know of it.
struct OutgoingLine {
  std::string text;              ///< As sent, without its end.
  std::int64_t line = 0;         ///< In the file; of a line of the sender's own the one before.
  std::int64_t next_offset = 0;  ///< Of the byte behind it in the file.
  bool numbered = false;         ///< Bears an N word that stands for `line`.
  bool cuts = false;             ///< Moves at feed.
  double travel = 0.0;           ///< Largest travel of one axis, mm.
  double dwell = 0.0;            ///< G4, s.
  /// The machine stands still, with everything carried out, before it is sent and until it is
  /// answered.
  bool barrier = false;
  /// The controller reads or writes its stored settings for it, during which an 8-bit board loses
  /// bytes: nothing else may be on its way.
  bool alone = false;
  std::optional<SpindleOrder> spindle;  ///< Where it changes.
  bool tool_change = false;             ///< M6
  bool pauses = false;                  ///< M0, M1
  bool ends = false;                    ///< M2, M30
};

/// How lines are made ready.
struct FeedOptions {
  GcodeDialect dialect;
  bool number_lines = false;  ///< Give each line an N word of our own where it fits.
  GcodeState start;           ///< Where the tool is and what is in force at the first line.
  std::int64_t first_line = 1;
  std::int64_t first_offset = 0;    ///< Where first_line begins.
  std::deque<OutgoingLine> before;  ///< The sender's own lines, ahead of the first.
};

/// Turns a program into the lines that a controller gets: compacted, numbered, with what it needs
/// beyond that (added_words()), nothing sent for blank lines and comments. Constant memory.
class ProgramFeed {
 public:
  /// @param in  must outlive the feed; seekable if it does not begin with the first line.
  ProgramFeed(std::istream& in, FeedOptions options);

  /// The next line to send; nothing after the end of the program.
  /// @throw GcodeError if a line is refused; RunError if the file cannot be read.
  std::optional<OutgoingLine> next();

  /// N words run from 1 to the dialect's largest and begin again.
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

/// What the sender puts behind a line that the Grbl family would refuse as it stands: of a circle
/// without coordinates those of its end, where the tool stands. @param after  the line.
std::string added_words(const GcodeEffect& effect, const GcodeState& after);

/// What is asked of the spindle in a state.
SpindleOrder spindle_order(const GcodeState& state);

}  // namespace lensforge
