// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/gcode/gcode_reader.h"
#include "machine/gcode/program_seal.h"
#include "machine/planner/planner_model.h"

// G-code programs without a controller: reading them, checking them against a dialect and their
// seal, and estimating their run time. machine/send.h sends them. The run time of a program:
//
//     GcodeReader reader(file);
//     GcodeInterpreter interpreter(grbl_dialect());
//     PlannerModel model(settings);
//     while (const std::optional<GcodeText> text = reader.next()) {
//       model.line(text->text.size() + 1);
//       const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
//       for (const GcodeMotion& motion : effect.motions()) model.add(motion);
//     }
//     const double seconds = model.finish().seconds;
