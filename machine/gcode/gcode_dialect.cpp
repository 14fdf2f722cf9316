// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_dialect.h"

#include "core/error.h"

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

}  // namespace lensforge
