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

GcodeDialect linuxcnc_dialect() {
  GcodeDialect dialect;
  dialect.name = "linuxcnc";
  dialect.max_characters = 255;
  dialect.max_line_number = 99'999;
  dialect.tool_change = true;
  dialect.mist = true;
  dialect.planner_blocks = 50;
  dialect.path_blending = true;
  dialect.tool_length = true;
  return dialect;
}

GcodeDialect fanuc_dialect() {
  GcodeDialect dialect;
  dialect.name = "fanuc";
  dialect.max_characters = 255;
  dialect.max_line_number = 99'999'999;
  dialect.tool_change = true;
  dialect.mist = true;
  dialect.planner_blocks = 40;
  dialect.contour_control = true;
  dialect.tool_length = true;
  dialect.program_number = true;
  dialect.dwell_unit = 1e-3;
  return dialect;
}

std::optional<GcodeDialect> find_dialect(std::string_view name) {
  for (const GcodeDialect& dialect :
       {grbl_dialect(), grblhal_dialect(), linuxcnc_dialect(), fanuc_dialect()}) {
    if (dialect.name == name) return dialect;
  }
  return std::nullopt;
}

GcodeDialect parse_dialect(std::string_view name, const std::string& option) {
  if (name == "grbl") return grbl_dialect();
  if (name == "grblhal") return grblhal_dialect();
  throw InputError(option + ": '" + std::string(name) + "' is none of grbl, grblhal");
}

}  // namespace lensforge
