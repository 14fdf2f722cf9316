// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "core/error.h"

namespace lensforge {

/// G-code that a controller's firmware accepts, apart from its settings.
struct GcodeDialect {
  std::string name;
  std::size_t max_characters = 0;    ///< Maximum line length as sent: compacted, without its end.
  std::int64_t max_line_number = 0;  ///< Largest N word.
  bool tool_change = false;          ///< M6. T is accepted by all.
  int max_tool = 0;                  ///< Largest number of T, and of H if supported.
  bool mist = false;                 ///< M7; Grbl has it only if built with it (M in [OPT:).
  std::size_t rx_bytes = 0;          ///< Usual size of the receive buffer.
  int planner_blocks = 0;            ///< Usual number of look-ahead motions.
  double lines_per_second = 0.0;  ///< Short moves that a usual board accepts; 0 if it reads files.
  /// The `$` setting that silently limits S words; 0 for none.
  int spindle_limit_setting = 0;
  bool path_blending = false;    ///< G64, with P the tolerance in mm, and G61.1.
  bool contour_control = false;  ///< G5.1 with Q.
  bool tool_length = false;      ///< G43 with H.
  bool loaded_length = false;    ///< G43 without H: the length of the tool in the spindle.
  /// G43.1 with Z. It and G49 must be on lines without a motion: Grbl would refuse the line or
  /// ignore its coordinates.
  bool stated_length = false;
  bool program_number = false;      ///< An O word, alone on the first line.
  double dwell_unit = 1.0;          ///< Seconds that G4 P1 waits.
  bool inches = true;               ///< G20
  bool radius_arcs = true;          ///< R
  bool rapid_word = true;           ///< G0
  bool feed_on_every_line = false;  ///< On every line that moves.
  /// Without G0: straight motions at exactly one of these feeds are rapids, mm/min.
  std::array<double, 2> rapid_feeds{};
  /// Only the operator switches the spindle: cuts need no M3. A property of the machine, not of the
  /// firmware.
  bool spindle_by_hand = false;
};

/// Grbl 1.1: line buffer of 80 with the line end, receive buffer of 128 bytes, 15 planned motions,
/// no M6.
GcodeDialect grbl_dialect();

/// grblHAL: line buffer of 257 with the line end, receive buffer of 1024 bytes, 35 to 100 planned
/// motions.
GcodeDialect grblhal_dialect();

/// LinuxCNC 2.9: lines of 255, M6, G43 with and without H, G64 with a tolerance. No byte limits
/// apply: it reads files.
GcodeDialect linuxcnc_dialect();

/// Fanuc-family mill (Series 0i and 30i): O number, T and M6, G43 with H, G5.1 with Q, dwell in ms.
GcodeDialect fanuc_dialect();

/// Weihong's NK105: no G0, no G20, no R, F on every line that moves.
GcodeDialect weihong_dialect();

/// Returns the dialect of a controller whose programs can be read: grbl, grblhal, linuxcnc, fanuc
/// or weihong; empty for other names.
std::optional<GcodeDialect> find_dialect(std::string_view name);

/// Returns the dialect of a controller that can be sent to: "grbl" or "grblhal". @throw InputError
/// naming `option` and the value.
GcodeDialect parse_dialect(std::string_view name, const std::string& option);

/// A program that is written for another dialect than the controller's. The message names the
/// line, what is wrong with it and the rule, not how to make another program.
class OtherDialect : public InputError {
 public:
  using InputError::InputError;
};

/// The header's comment that states a program's dialect: "dialect: grbl".
std::string dialect_text(std::string_view name);

/// A dialect that a program's header states.
struct StatedDialect {
  std::string name;  ///< Of find_dialect().
  std::int64_t line = 0;
};

/// Reads the comments above the first command. Empty for a program without such a statement, and
/// for one whose first lines cannot be read.
std::optional<StatedDialect> stated_dialect(std::istream& program);

/// Refuses a program that its header, or else a word of its first lines, shows to be written for
/// none of the Grbl family. A line that no dialect accepts is left to examine_program().
/// @param name  the program's, in messages.
/// @throw OtherDialect
void require_grbl_family(std::istream& program, const std::string& name);

}  // namespace lensforge
