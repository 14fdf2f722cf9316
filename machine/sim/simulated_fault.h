// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

namespace lensforge {

/// Way of a byte between host and controller.
enum class WireDirection { kToController, kToHost };

/// What can go wrong.
enum class FaultKind {
  kUnplug,        ///< The link is gone for `seconds`; the controller goes on.
  kUnplugReset,   ///< Likewise, and the controller is without power meanwhile.
  kReset,         ///< The controller starts anew by itself and greets (brown-out).
  kAlarm,         ///< Alarm `code`; 0 stands for 1, a limit switch.
  kError,         ///< The next G-code line is answered by error `code` (0: 20) and not run.
  kLostReply,     ///< The next ok or error is lost on its way.
  kGarbledReply,  ///< The next ok or error arrives with a wrong byte.
  kDuplicatedOk,  ///< The next ok arrives twice.
  kStall,         ///< Nothing is heard of the controller for `seconds`.
  kRxOverrun,     ///< `code` (0: 8) bytes find the receive buffer full.
  kPartialWrite,  ///< The link takes part of a write, then nothing for `seconds`.
  kDoor,          ///< The door opens, and closes after `seconds`.
  kHold,          ///< Somebody presses feed hold at the machine.
  kDroppedByte,   ///< One byte vanishes.
};
constexpr int kFaultKinds = 14;

/// "unplug", "unplug-reset", "reset", … as tables name it.
std::string fault_name(FaultKind kind);

/// One fault, once: it strikes when so many bytes have gone `direction`'s way since power-up, at
/// the byte after them.
struct SimulatedFault {
  FaultKind kind = FaultKind::kStall;
  WireDirection direction = WireDirection::kToController;
  std::int64_t at_byte = 0;
  double seconds = 1.0;
  int code = 0;
};

}  // namespace lensforge
