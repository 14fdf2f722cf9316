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
  if (rx_read_ == rx_.size() || rx_read_ > 4096) {
    rx_.erase(0, rx_read_);
    rx_read_ = 0;
  }
  if (rx_.size() - rx_read_ >= options_.rx_bytes) {
    ++lost_;
    if (!losing_now_) event("overrun");
    losing_now_ = true;
    return;
  }
  losing_now_ = false;
  rx_ += byte;
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
      if (!critical_) {
        // The command opens no switch: the machine stops as if one had opened and closed.
        move_door(true);
        door_open_ = false;
      }
      return true;
    case 0x85:
      cancel_jog();
      return true;
    default:
      break;
  }
  if (byte < 0x80) return false;
  if (is_hal() && byte == 0x80) report();
  if (is_hal() && byte == 0x81) cycle_start();
  if (is_hal() && byte == 0x82) feed_hold();
  if (is_hal() && byte == 0x87) {
    offset_countdown_ = 0;
    report();
  }
  if (is_hal() && byte == 0xA3) acknowledge_tool();
  override_command(byte);
  return true;
}

void SimulatedController::change_override(double& value, double by) {
  value = by == 0.0 ? 100.0 : std::clamp(value + by, 10.0, 200.0);
}

bool SimulatedController::override_command(unsigned char byte) {
  constexpr double kSteps[] = {0.0, 10.0, -10.0, 1.0, -1.0};
  if (byte >= 0x90 && byte <= 0x94) {
    change_override(feed_override_, kSteps[byte - 0x90]);
  } else if (byte >= 0x95 && byte <= 0x97) {
    rapid_override_ = byte == 0x95 ? 100.0 : byte == 0x96 ? 50.0 : 25.0;
  } else if (byte >= 0x99 && byte <= 0x9D) {
    change_override(spindle_override_, kSteps[byte - 0x99]);
  } else {
    return false;
  }
  queue_.set_overrides(feed_override_, rapid_override_);
  override_countdown_ = 0;
  return true;
}

}  // namespace lensforge
