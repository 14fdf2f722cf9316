// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_dialect.h"

#include "core/error.h"

namespace lensforge {

GcodeDialect grbl_dialect() {
  GcodeDialect dialect;
  dialect.name = "grbl";
  dialect.max_characters = 79;
  dialect.max_line_number = 9'999'999;
  dialect.rx_bytes = 128;
  dialect.planner_blocks = 15;
  return dialect;
}

GcodeDialect grblhal_dialect() {
  GcodeDialect dialect;
  dialect.name = "grblhal";
  dialect.max_characters = 255;
  dialect.max_line_number = 9'999'999;
  dialect.tool_change = true;
  dialect.mist = true;
  dialect.refuses_after_error = true;
  dialect.rx_bytes = 1024;
  dialect.planner_blocks = 35;
  return dialect;
}

GcodeDialect parse_dialect(std::string_view name, const std::string& option) {
  if (name == "grbl") return grbl_dialect();
  if (name == "grblhal") return grblhal_dialect();
  throw InputError(option + ": '" + std::string(name) + "' is none of grbl, grblhal");
}

}  // namespace lensforge
