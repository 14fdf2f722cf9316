// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <stop_token>

#include "core/compute/run_control.h"
#include "machine/stream/controller_dialogue.h"

namespace lensforge {

/// How a controller is taken over.
struct SessionOptions {
  /// After a fault: a machine that moves or stands in a hold is held and reset.
  bool resume = false;
  bool home = false;  ///< Run the homing cycle.
  /// For the first answer, s: boards that start when the port is opened take two seconds. One that
  /// stays silent is noticed within 3 s, homing or not.
  double wake_timeout = 2.4;
  double home_timeout = 300.0;
};

/// Takes over a controller: waits for it, soft-resets it (which keeps the position where nothing
/// moves, and drops half a line that an earlier sender left), homes if asked to, and learns.
/// @throw InputError if it moves, is held or has its door open; StreamFault; LinkLost
ControllerInfo open_session(Wire& wire, Clock& clock, const SessionOptions& options,
                            const std::stop_token& stop);

/// Seconds from a line to its ok: the middle one of several empty lines. @throw StreamFault
double measure_round_trip(Wire& wire, Clock& clock, const std::stop_token& stop);

/// Lets the controller check every line without moving ($C). It is out of check mode and as after a
/// reset then, however the check ends.
/// @return lines checked. @throw StreamFault naming the line, or what does not answer; GcodeError;
///         LinkLost, after which it may still be in check mode
std::int64_t check_on_controller(Wire& wire, Clock& clock, std::istream& program,
                                 const ControllerInfo& info, const RunControl& control);

}  // namespace lensforge
