// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <stop_token>

#include "core/compute/executor.h"
#include "machine/stream/controller_dialogue.h"

namespace lensforge {

/// Options for taking over a controller.
struct SessionOptions {
  /// After a fault: hold and reset a machine that moves or is in a hold.
  bool resume = false;
  bool home = false;  ///< Run the homing cycle.
  /// Limit for the first answer, s: boards that restart when the port is opened take two seconds. A
  /// silent board is detected within 3 s, also with homing.
  double wake_timeout = 2.4;
  double home_timeout = 300.0;
};

/// Takes over a controller: waits for it, soft-resets it (which keeps the position if nothing
/// moves, and drops a partial line of an earlier sender), homes if requested, and reads its
/// properties.
/// @throw InputError if it moves, is held or has its door open; StreamFault; LinkLost
ControllerInfo open_session(Wire& wire, Clock& clock, const SessionOptions& options,
                            const std::stop_token& stop);

/// Time from a line to its ok, s: the median of several empty lines. @throw StreamFault
double measure_round_trip(Wire& wire, Clock& clock, const std::stop_token& stop);

/// Lets the controller check every line without moving ($C). However the check ends, the controller
/// then is out of check mode and reset. @return number of lines checked. @throw StreamFault naming
/// the line, or the part that does not answer; GcodeError; LinkLost, after which it may still be in
/// check mode
std::int64_t check_on_controller(Wire& wire, Clock& clock, std::istream& program,
                                 const ControllerInfo& info, const RunControl& control);

}  // namespace lensforge
