// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_dialect.h"

#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/text/words.h"
#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {
namespace {

/// Common properties of the Grbl family.
GcodeDialect grbl_family() {
  GcodeDialect dialect;
  dialect.max_line_number = 9'999'999;
  dialect.max_tool = 255;
  dialect.spindle_limit_setting = 30;
  dialect.stated_length = true;
  return dialect;
}

}  // namespace

GcodeDialect grbl_dialect() {
  GcodeDialect dialect = grbl_family();
  dialect.name = "grbl";
  dialect.max_characters = 79;
  dialect.rx_bytes = 128;
  dialect.planner_blocks = 15;
  dialect.lines_per_second = 400.0;  // An 8-bit board.
  return dialect;
}

GcodeDialect grblhal_dialect() {
  GcodeDialect dialect = grbl_family();
  dialect.name = "grblhal";
  dialect.max_characters = 255;
  dialect.tool_change = true;
  dialect.mist = true;
  dialect.rx_bytes = 1024;
  dialect.planner_blocks = 35;
  dialect.lines_per_second = 4000.0;  // A 32-bit board.
  return dialect;
}

GcodeDialect linuxcnc_dialect() {
  GcodeDialect dialect;
  dialect.name = "linuxcnc";
  dialect.max_characters = 255;
  dialect.max_line_number = 99'999;
  dialect.tool_change = true;
  dialect.max_tool = 99'999;
  dialect.mist = true;
  dialect.planner_blocks = 50;
  dialect.path_blending = true;
  dialect.tool_length = dialect.loaded_length = true;
  return dialect;
}

GcodeDialect fanuc_dialect() {
  GcodeDialect dialect;
  dialect.name = "fanuc";
  dialect.max_characters = 255;
  dialect.max_line_number = 99'999'999;
  dialect.tool_change = true;
  dialect.max_tool = 999;  // T has eight digits, but there are at most 999 offsets for H.
  dialect.mist = true;
  dialect.planner_blocks = 40;
  dialect.contour_control = true;
  dialect.tool_length = true;
  dialect.program_number = true;
  dialect.dwell_unit = 1e-3;
  return dialect;
}

GcodeDialect weihong_dialect() {
  GcodeDialect dialect;
  dialect.name = "weihong";
  dialect.max_characters = 255;
  dialect.max_line_number = 99'999;
  dialect.max_tool = 99;
  dialect.planner_blocks = 40;
  dialect.inches = dialect.radius_arcs = dialect.rapid_word = false;
  dialect.feed_on_every_line = true;
  return dialect;
}

std::optional<GcodeDialect> find_dialect(std::string_view name) {
  for (const GcodeDialect& dialect : {grbl_dialect(), grblhal_dialect(), linuxcnc_dialect(),
                                      fanuc_dialect(), weihong_dialect()}) {
    if (dialect.name == name) return dialect;
  }
  return std::nullopt;
}

GcodeDialect parse_dialect(std::string_view name, const std::string& option) {
  if (name == "grbl") return grbl_dialect();
  if (name == "grblhal") return grblhal_dialect();
  throw InputError(option + ": '" + std::string(name) + "' is none of grbl, grblhal");
}

namespace {

constexpr std::string_view kKey = "dialect: ";

/// Dialects differ in what comes before the first cut: modes, tool, tool length.
constexpr std::int64_t kProbedLines = 400;

constexpr const char* kFamilyRule = "send takes programs for grbl and grblhal only";

bool is_family(std::string_view name) {
  return name == grbl_dialect().name || name == grblhal_dialect().name;
}

/// The dialect that a comment states; empty for all other lines.
std::string dialect_in(std::string_view line) {
  std::string text(line);
  for (char& c : text) c = lower(c);
  const std::size_t begin = text.find_first_of("(;");
  if (begin == std::string::npos) return "";
  const std::size_t key = text.find_first_not_of(" \t", begin + 1);
  if (key == std::string::npos || text.compare(key, kKey.size(), kKey) != 0) return "";
  const std::size_t name = key + kKey.size();
  const std::size_t end = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789", name);
  const std::string stated = text.substr(name, end == std::string::npos ? end : end - name);
  return find_dialect(stated) ? stated : "";
}

/// True for comments, % and a program number.
bool is_header(std::string_view line) {
  const std::string words = compact_gcode(line, false);
  return words.empty() || words.front() == 'O';
}

/// A line that a dialect refuses.
struct Refusal {
  std::int64_t line = 0;
  std::string reason;  ///< "line 16: G64 is not supported for grblhal"
};

/// The first line that the dialect refuses, up to `last`.
std::optional<Refusal> first_refusal(std::istream& program, const GcodeDialect& dialect,
                                     std::int64_t last) {
  program.clear();
  program.seekg(0);
  GcodeReader reader(program);
  GcodeInterpreter interpreter(dialect);
  try {
    while (!interpreter.ended()) {
      const std::optional<GcodeText> text = reader.next();
      if (!text || text->line > last) break;
      interpreter.run(parse_gcode_block(*text));
    }
  } catch (const GcodeError& refused) {
    return Refusal{refused.line(), refused.what()};
  }
  return std::nullopt;
}

}  // namespace

std::string dialect_text(std::string_view name) { return std::string(kKey).append(name); }

std::optional<StatedDialect> stated_dialect(std::istream& program) {
  GcodeReader reader(program);
  try {
    while (const std::optional<GcodeText> text = reader.next()) {
      if (text->line > kProbedLines || !is_header(text->text)) break;
      std::string name = dialect_in(text->text);
      if (!name.empty()) return StatedDialect{std::move(name), text->line};
    }
  } catch (const GcodeError&) {
    return std::nullopt;  // examine_program() names it.
  }
  return std::nullopt;
}

void require_grbl_family(std::istream& program, const std::string& name) {
  if (const std::optional<StatedDialect> stated = stated_dialect(program)) {
    if (is_family(stated->name)) return;
    throw OtherDialect(joined({name, ": line ", std::to_string(stated->line),
                               " states the dialect ", stated->name, "; ", kFamilyRule}));
  }
  // grblHAL knows all that Grbl knows.
  const std::optional<Refusal> refusal = first_refusal(program, grblhal_dialect(), kProbedLines);
  if (!refusal) return;
  std::string others;
  for (const GcodeDialect& other : {linuxcnc_dialect(), fanuc_dialect(), weihong_dialect()}) {
    if (first_refusal(program, other, refusal->line)) continue;
    if (!others.empty()) others += " or ";
    others += other.name;
  }
  if (others.empty()) return;
  throw OtherDialect(joined(
      {name, ": ", refusal->reason, ": the program is written for ", others, "; ", kFamilyRule}));
}

}  // namespace lensforge
