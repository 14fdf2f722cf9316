// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {

/// A program's text with its motions, or why and where it was refused.
struct ProgramRun {
  std::vector<GcodeMotion> motions;
  GcodeState state;
  std::string refusal;  ///< Empty: the whole program passed.
  std::int64_t refused_line = 0;
  std::int64_t lines = 0;
};

/// Reads and runs a whole program.
inline ProgramRun run_program(const std::string& program,
                              const GcodeDialect& dialect = grbl_dialect(),
                              const GcodeState& start = {}) {
  ProgramRun result;
  std::istringstream in(program);
  GcodeReader reader(in);
  GcodeInterpreter interpreter(dialect, start);
  try {
    while (const auto text = reader.next()) {
      interpreter.check_length(*text, 0);
      const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
      for (const GcodeMotion& motion : effect.motions()) result.motions.push_back(motion);
      ++result.lines;
    }
  } catch (const GcodeError& error) {
    result.refusal = error.what();
    result.refused_line = error.line();
  }
  result.state = interpreter.state();
  return result;
}

}  // namespace lensforge
