// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/stream_fault.h"

namespace lensforge {

std::string_view fault_name(FaultKind kind) {
  switch (kind) {
    case FaultKind::kNone:
      return "none";
    case FaultKind::kInterrupted:
      return "interrupted";
    case FaultKind::kGarbledReply:
      return "garbled reply";
    case FaultKind::kCountMismatch:
      return "reply count";
    case FaultKind::kError:
      return "error";
    case FaultKind::kAlarm:
      return "alarm";
    case FaultKind::kReset:
      return "reset";
    case FaultKind::kStall:
      return "stall";
    case FaultKind::kLinkLost:
      return "link lost";
    case FaultKind::kDoor:
      return "door";
    case FaultKind::kHeld:
      return "held";
    case FaultKind::kUnexpectedState:
      return "unexpected state";
    case FaultKind::kSpindle:
      return "spindle";
    case FaultKind::kInterlock:
      return "interlock";
    case FaultKind::kJournal:
      return "journal";
    case FaultKind::kProgram:
      return "program";
  }
  return {};
}

}  // namespace lensforge
