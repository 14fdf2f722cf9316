// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_fault.h"

#include <array>

namespace lensforge {

std::string fault_name(FaultKind kind) {
  constexpr std::array<const char*, kFaultKinds> kNames{
      "unplug",        "unplug-reset",  "reset",         "alarm",       "error",
      "lost-reply",    "garbled-reply", "duplicated-ok", "stall",       "rx-overrun",
      "partial-write", "door",          "hold",          "dropped-byte"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace lensforge
