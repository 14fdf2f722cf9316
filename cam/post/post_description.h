// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

class Description;
struct Workshop;

/// Form of arcs.
enum class ArcForm {
  kCentre,  ///< I J K from the start point to the centre.
  kRadius,  ///< R
  kNone,    ///< Not at all: chords.
};

/// Lines with an N word.
enum class LineNumbers {
  kNone,
  kOperations,  ///< The first of each operation.
  kAll,
};

/// Grouping of operations into files. A dialect without tool change never has two tools in one.
enum class ProgramGrouping {
  kOperation,  ///< One file for each name: rough.ngc, finish.ngc.
  kTool,       ///< Operations in a row with one tool, their names joined: finish-pencil.ngc.
  kAll,        ///< One file, named after the job, where the dialect changes tools; else as kTool.
};

enum class Coolant { kOff, kMist, kFlood };

/// A dialect of G-code as data, with the keys of cam/post/linuxcnc.toml and its neighbours.
struct PostDescription {
  std::string name;
  std::string extension;  ///< Of files, without the point.
  GcodeDialect reader;    ///< Our own parser for such programs.

  int most_decimals = 6;  ///< Of coordinates.
  bool trailing_zeros = true;
  bool whole_with_point = false;  ///< "500." in F.
  int feed_decimals = 3;

  std::size_t longest_line = 80;  ///< Without its end.
  bool crlf = false;
  bool percent = false;
  bool spaces = true;
  bool repeat_motion = false;
  bool feed_on_every_line = false;  ///< Of those at feed.
  LineNumbers numbers = LineNumbers::kNone;
  std::int64_t first_number = 10;
  std::int64_t number_step = 10;
  std::int64_t largest_number = 99990;
  std::uintmax_t largest_file = 0;  ///< Bytes; 0: no limit.

  std::string comment_open = "(";
  std::string comment_close = ")";
  bool upper_case_comments = false;

  /// The first two are equal if there is no word for rapids (rapids_are_feeds()).
  std::array<std::string, 4> motions{"G0", "G1", "G2", "G3"};
  /// By the number of the axis that the plane is normal to: YZ, ZX, XY.
  std::array<std::string, 3> planes{"G19", "G18", "G17"};
  std::string mist;  ///< Empty if there is none; flood too.
  std::string flood;
  std::string coolant_off;

  ArcForm arcs = ArcForm::kCentre;
  bool helix = true;

  // Lines with placeholders, see fill_line().
  std::int64_t first_program_number = 1;
  std::vector<std::string> head;
  std::vector<std::string> start;
  std::vector<std::string> tool;  ///< Empty: no tool change, one file for each tool.
  std::vector<std::string> spindle;
  std::vector<std::string> tool_end;
  std::vector<std::string> end;
  bool applies_length = false;  ///< `tool` applies the tool's length (G43).

  [[nodiscard]] bool changes_tools() const { return !tool.empty(); }
  [[nodiscard]] bool rapids_are_feeds() const { return motions[0] == motions[1]; }
};

/// Names of the descriptions that are built in: linuxcnc, grbl, grblhal, fanuc, weihong.
std::vector<std::string> builtin_posts();

/// Reads a description and tests it: the description's own reader must read a small program made
/// from its lines, in millimetres, absolute, feed per minute, with the spindle running where it
/// cuts, and ended at the end.
/// @param file  its name in messages.
/// @throw InputError naming file, key, value and rule; unknown keys are refused.
PostDescription parse_post(std::string_view toml, const std::string& file);

/// A built-in name, or the path of a TOML file (with a slash or ending in .toml).
/// @throw InputError naming `option` and the value if it is neither; as parse_post().
PostDescription find_post(const std::string& name_or_path, const std::string& option);

/// The dialect that a workshop states (Machine::post); a description's path is relative to the
/// folder of the workshop's file. @param file  the workshop's; empty for none.
/// @throw InputError naming file, key and value; as parse_post().
PostDescription post_of(const Workshop& workshop, const std::string& file);

/// The option --post. It replaces the workshop's dialect, too.
void describe_post(Description& d, PostDescription& post, Workshop& workshop);

/// Texts for the placeholders of a description's lines; an empty text drops the line.
using PlaceholderTexts = std::map<std::string, std::string, std::less<>>;

/// True if it is the name of a placeholder.
bool is_placeholder(std::string_view name);

/// A line with its placeholders {name} filled in; nothing if one of their texts is empty.
/// @pre the line is one of a description that parse_post() took.
std::optional<std::string> fill_line(std::string_view line, const PlaceholderTexts& texts);

/// A feed in the dialect's format: rounded to its decimals, but not to 0.
std::string feed_text(const PostDescription& post, double feed);

/// Appends `units` of the last decimal as a number: exact, no exponent, no negative zero, no
/// locale.
void append_coordinate(std::string& line, std::int64_t units, int decimals,
                       const PostDescription& post);

/// Text that is safe inside a comment of the dialect, at most `longest` characters: brackets,
/// characters on which Grbl acts anywhere (? ! ~) and all but printable ASCII become _.
std::string comment_text(const PostDescription& post, std::string_view text, std::size_t longest);

/// A whole comment line.
std::string comment_line(const PostDescription& post, std::string_view text);

/// A comment line of the maximum length, so that any other fits in its place.
std::string padded_comment_line(const PostDescription& post, std::string_view text);

}  // namespace lensforge
