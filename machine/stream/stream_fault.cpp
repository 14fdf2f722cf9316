// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/stream_fault.h"

namespace lensforge {

std::string_view cause_name(StopCause cause) {
  switch (cause) {
    case StopCause::kNone:
      return "none";
    case StopCause::kInterrupted:
      return "interrupted";
    case StopCause::kGarbledReply:
      return "garbled reply";
    case StopCause::kCountMismatch:
      return "reply count";
    case StopCause::kError:
      return "error";
    case StopCause::kAlarm:
      return "alarm";
    case StopCause::kReset:
      return "reset";
    case StopCause::kStall:
      return "stall";
    case StopCause::kLinkLost:
      return "link lost";
    case StopCause::kDoor:
      return "door";
    case StopCause::kHeld:
      return "held";
    case StopCause::kUnexpectedState:
      return "unexpected state";
    case StopCause::kSpindle:
      return "spindle";
    case StopCause::kInterlock:
      return "interlock";
    case StopCause::kJournal:
      return "journal";
    case StopCause::kProgram:
      return "program";
  }
  return {};
}

}  // namespace lensforge
