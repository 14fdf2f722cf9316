// SPDX-License-Identifier: GPL-3.0-or-later
// Bytes from the wire: the receive buffer, and the commands that go past it.
#include <algorithm>

#include "machine/sim/simulated_controller.h"

namespace lensforge {

void SimulatedController::receive(char byte) {
  if (now_ < deaf_until_ || losing_ > 0) {
    losing_ = std::max(0, losing_ - 1);
    ++lost_;
    return;
  }
  if (realtime(static_cast<unsigned char>(byte))) return;
  if (rx_.size() >= options_.rx_bytes) {
    ++lost_;
    if (!losing_now_) event("overrun");
    losing_now_ = true;
    return;
  }
  losing_now_ = false;
  rx_.add(byte);
}

/// Whether the byte was a command, or is none of the line's business.
bool SimulatedController::realtime(unsigned char byte) {
  switch (byte) {
    case '?':
      report();
      return true;
    case '!':
      feed_hold();
      return true;
    case '~':
      cycle_start();
      return true;
    case 0x18:
      soft_reset();
      return true;
    case 0x84:
      open_and_shut_door();
      return true;
    case 0x85:
      cancel_jog();
      return true;
    default:
      break;
  }
  if (byte < 0x80) return false;
  if (is_hal()) hal_command(byte);
  if (const auto changed = overridden(overrides_, byte)) {
    set_overrides(*changed);
    countdowns_.overrides = 0;
  }
  return true;
}

/// The command opens no switch: the machine stops as if one had opened and closed.
void SimulatedController::open_and_shut_door() {
  if (machine_.critical) return;
  move_door(true);
  machine_.door_open = false;
}

void SimulatedController::hal_command(unsigned char byte) {
  if (byte == 0x80) report();
  if (byte == 0x81) cycle_start();
  if (byte == 0x82) feed_hold();
  if (byte == 0x87) {
    countdowns_.offset = 0;
    report();
  }
  if (byte == 0xA3) acknowledge_tool();
}

void SimulatedController::report() {
  // Grbl is silent while it homes and once a limit has locked it.
  if (!is_hal() && (machine_.critical || machine_.state == MachineState::kHome)) return;
  const SimReport report = report_of(snapshot(), countdowns_);
  countdowns_ = report.next;
  say(report.text);
}

SimSnapshot SimulatedController::snapshot() const {
  const bool numbers = options_.line_numbers || is_hal();
  SimSnapshot seen;
  seen.state = state_text();
  seen.rests = machine_.state == MachineState::kIdle || machine_.state == MachineState::kAlarm;
  seen.mask = static_cast<int>(settings_[10]);
  seen.inches = settings_.on(13);
  seen.position = queue_.position();
  seen.offset = gcode_.offset();
  seen.free_blocks = queue_.room();
  seen.free_bytes = options_.rx_bytes - rx_.size();
  seen.number = numbers && machine_.state != MachineState::kJog ? queue_.number() : 0;
  seen.speed = queue_.speed();
  seen.rpm = queue_.rpm;
  seen.door_open = machine_.door_open;
  seen.overrides = overrides_;
  seen.spindle = queue_.spindle;
  seen.coolant = coolant_;
  return seen;
}

}  // namespace lensforge
