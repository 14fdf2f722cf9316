// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/frame/command_run.h"
#include "cam/check/lamp_picture.h"
#include "cam/plan/cam_options.h"

/// `lensforge check --lamp-from`: the picture of a lamp from a photograph of the wall.
namespace lensforge::app {

/// Its options.
struct LampFrom {
  std::string photo;      ///< Empty: no lamp is asked for.
  Pinhole pinhole;        ///< Without a lens.
  double diameter = 0.0;  ///< Of the hole, mm; 0: not known.
  double distance = 0.0;  ///< Of the lamp from the hole, mm; 0: far away.
};

void describe(Description& d, LampFrom& lamp);

/// What else it takes of `check`.
struct LampTask {
  LampFrom lamp;
  std::string lens;  ///< Folder; empty: a pinhole.
  std::string dark;
  std::string out;
  bool force = false;
  CamOptions cam;
};

/// @throw InputError if the options do not fit each other.
void validate(const LampTask& task);

/// Writes source.png. @throw InputError as lamp_by_pinhole() and lamp_by_lens().
CommandResult measure_lamp(CommandFrame& frame, const LampTask& task);

}  // namespace lensforge::app
