// SPDX-License-Identifier: GPL-3.0-or-later
// Status reports.
#include "machine/sim/sim_text.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {
namespace {

// Reports between two that carry the field, at rest and in motion.
constexpr int kOffsetAtRest = 10;
constexpr int kOffsetInMotion = 30;
constexpr int kOverrideAtRest = 10;
constexpr int kOverrideInMotion = 20;

}  // namespace

std::string SimulatedController::state_text() const {
  switch (state_) {
    case MachineState::kIdle:
      return "Idle";
    case MachineState::kRun:
      return "Run";
    case MachineState::kHold:
      return stopped_ ? "Hold:0" : "Hold:1";
    case MachineState::kJog:
      return "Jog";
    case MachineState::kAlarm:
      return is_hal() && alarm_ != 0 ? numbered("Alarm:", alarm_) : "Alarm";
    case MachineState::kDoor:
      if (restoring_until_ > now_) return "Door:3";
      if (!stopped_) return "Door:2";
      return door_open_ ? "Door:1" : "Door:0";
    case MachineState::kCheck:
      return "Check";
    case MachineState::kHome:
      return "Home";
    case MachineState::kSleep:
      return "Sleep";
    case MachineState::kTool:
      return "Tool";
  }
  return "Idle";
}

std::string SimulatedController::coordinates(const Eigen::Vector3d& point) const {
  return settings_.on(13) ? fixed_text(Eigen::Vector3d(point / 25.4), 4) : fixed_text(point, 3);
}

void SimulatedController::report() {
  // Grbl is silent while it homes and once a limit has locked it.
  if (!is_hal() && (critical_ || state_ == MachineState::kHome)) return;
  const int mask = static_cast<int>(settings_[10]);
  const bool machine = (mask & 1) != 0;
  const Eigen::Vector3d offset = gcode_.offset();
  const Eigen::Vector3d place = queue_.position();
  std::string text("<");
  text.append(state_text());
  text.append(machine ? "|MPos:" : "|WPos:");
  text.append(coordinates(machine ? place : Eigen::Vector3d(place - offset)));
  if ((mask & 2) != 0) {
    const std::size_t free = options_.rx_bytes - (rx_.size() - rx_read_);
    text.append("|Bf:").append(std::to_string(queue_.room())).append(",");
    text.append(std::to_string(free));
  }
  const bool numbers = options_.line_numbers || is_hal();
  if (numbers && queue_.number() > 0 && state_ != MachineState::kJog) {
    text.append("|Ln:").append(std::to_string(queue_.number()));
  }
  const double speed = queue_.speed() * 60.0 / (settings_.on(13) ? 25.4 : 1.0);
  text.append("|FS:").append(fixed_text(speed, 0)).append(",").append(fixed_text(queue_.rpm, 0));
  if (door_open_) text.append("|Pn:D");
  report_extras(text);
  say(text + ">\r\n");
}

/// Offsets now and then; overrides likewise, never in the same report.
void SimulatedController::report_extras(std::string& text) {
  const bool rests = state_ == MachineState::kIdle || state_ == MachineState::kAlarm;
  if (offset_countdown_-- <= 0) {
    offset_countdown_ = (rests ? kOffsetAtRest : kOffsetInMotion) - 1;
    if (override_countdown_ <= 0) override_countdown_ = 1;
    text.append("|WCO:").append(coordinates(gcode_.offset()));
    return;
  }
  if (--override_countdown_ > 0) return;
  override_countdown_ = rests ? kOverrideAtRest : kOverrideInMotion;
  text.append("|Ov:").append(fixed_text(feed_override_, 0)).append(",");
  text.append(fixed_text(rapid_override_, 0)).append(",");
  text.append(fixed_text(spindle_override_, 0));
  std::string accessories;
  if (queue_.spindle != 0) accessories += queue_.spindle > 0 ? "S" : "C";
  if ((coolant_ & 2) != 0) accessories += "F";
  if ((coolant_ & 1) != 0) accessories += "M";
  if (!accessories.empty()) text.append("|A:").append(accessories);
}

}  // namespace lensforge
