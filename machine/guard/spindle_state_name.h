// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "machine/guard/guard.h"

namespace lensforge {

/// "stopped", "changing", "at speed" or "failed".
constexpr const char* spindle_state_name(SpindleState state) {
  switch (state) {
    case SpindleState::kStopped:
      return "stopped";
    case SpindleState::kChanging:
      return "changing";
    case SpindleState::kAtSpeed:
      return "at speed";
    case SpindleState::kFailed:
      break;
  }
  return "failed";
}

}  // namespace lensforge
