// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_fuzz.h"

#include <sstream>
#include <string>

#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {
namespace {

void check_text(const GcodeText& text, std::int64_t previous_end) {
  LF_CHECK(text.offset == previous_end, std::to_string(text.offset));
  LF_CHECK(text.next_offset >= text.offset + static_cast<std::int64_t>(text.text.size()),
           std::to_string(text.next_offset));
  LF_CHECK(text.text.size() <= GcodeReader::kLongestLine, std::to_string(text.text.size()));
  bool in_brackets = false;
  for (const char c : text.text) {
    const auto byte = static_cast<unsigned char>(c);
    if (!in_brackets && c == ';') return;
    if (c == '(' || c == ')') in_brackets = c == '(';
    if (in_brackets) continue;
    LF_CHECK(byte == '\t' || (byte >= ' ' && byte < 0x7F), std::to_string(byte));
    LF_CHECK(c != '?' && c != '!' && c != '~', std::string(1, c));
  }
}

void check_motion(const GcodeMotion& motion, const Eigen::Vector3d& from) {
  LF_CHECK(motion.start == from, "a motion that does not begin where the last one ended");
  LF_CHECK(motion.end.allFinite(), "a motion to nowhere");
  LF_CHECK(motion.rapid || motion.feed >= 0.0, std::to_string(motion.feed));
  if (motion.arc) LF_CHECK(motion.arc->radius > 0.0, std::to_string(motion.arc->radius));
}

/// What is sent instead of a line must mean the same.
void check_compact(const GcodeText& text, const GcodeBlock& block) {
  const std::string compact = compact_gcode(text.text, true);
  for (const char c : compact) LF_CHECK(c > ' ' && c < 0x7F, compact);
  LF_CHECK(compact.find_first_of("?!~") == std::string::npos, compact);
  GcodeText again = text;
  again.text = compact;
  const GcodeBlock read = parse_gcode_block(again);
  LF_CHECK(read.number == block.number, compact);
  LF_CHECK(read.words().size() == block.words().size(), compact);
  for (std::size_t i = 0; i < read.words().size(); ++i) {
    LF_CHECK(read.words()[i].letter == block.words()[i].letter, compact);
    LF_CHECK(read.words()[i].value == block.words()[i].value, compact);
  }
}

std::int64_t check_program(const std::string& program, const GcodeDialect& dialect) {
  std::istringstream in(program);
  GcodeReader reader(in);
  GcodeInterpreter interpreter(dialect);
  std::int64_t lines = 0;
  std::int64_t end = 0;
  try {
    while (const auto text = reader.next()) {
      check_text(*text, end);
      end = text->next_offset;
      const GcodeBlock block = parse_gcode_block(*text);
      check_compact(*text, block);
      Eigen::Vector3d position = interpreter.state().position;
      const GcodeEffect effect = interpreter.run(block);
      for (const GcodeMotion& motion : effect.motions()) {
        check_motion(motion, position);
        position = motion.end;
      }
      ++lines;
    }
  } catch (const GcodeError& error) {
    LF_CHECK(error.line() >= 1, error.what());
  }
  return lines;
}

}  // namespace

std::int64_t fuzz_gcode(const std::uint8_t* data, std::size_t size) {
  const std::string program(data, data + size);
  std::int64_t lines = 0;
  for (const GcodeDialect& dialect : {grbl_dialect(), grblhal_dialect(), linuxcnc_dialect(),
                                      fanuc_dialect(), weihong_dialect()}) {
    lines += check_program(program, dialect);
  }
  return lines;
}

}  // namespace lensforge
