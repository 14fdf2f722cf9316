// SPDX-License-Identifier: GPL-3.0-or-later
// Lines that begin with $.
#include <charconv>
#include <cmath>

#include "machine/sim/sim_text.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {
namespace {

/// The whole of `text` as a number; NaN if it is none.
double number_in(const std::string& text) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  return error == std::errc() && stop == end ? value : std::nan("");
}

}  // namespace

/// @return 0, the number of the error, or −1 for an answer that comes later.
int SimulatedController::run_system(const std::string& line) {
  if (line == "$") {
    say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n");
    return 0;
  }
  if (line == "$$") return print_settings();
  if (line == "$G") {
    say(gcode_.state_text());
    return 0;
  }
  if (line == "$C") return toggle_check();
  if (line == "$X") return unlock();
  if (line.rfind("$J", 0) == 0) return jog(line);
  const bool taken = sim_state::still(machine_, motion()) || machine_.state == MachineState::kTool;
  return taken ? idle_system(line) : 8;
}

int SimulatedController::idle_system(const std::string& line) {
  if (line == "$#") {
    say(gcode_.parameters_text());
    return 0;
  }
  if (line == "$I") {
    print_build();
    return 0;
  }
  if (line == "$H") return home();
  if (line == "$SLP") return sleep();
  if (line.rfind("$RST=", 0) == 0) return restore(line);
  if (line.rfind("$N", 0) == 0) return startup_lines(line);
  return write_setting(line);
}

int SimulatedController::print_settings() {
  if (machine_.state == MachineState::kRun || machine_.state == MachineState::kHold) return 8;
  say(settings_.text());
  return 0;
}

int SimulatedController::toggle_check() {
  if (machine_.state == MachineState::kCheck) {
    say("[MSG:Disabled]\r\n");
    reset_after_answer_ = true;
    return 0;
  }
  if (machine_.state != MachineState::kIdle || !queue_.empty()) return 8;
  machine_.state = MachineState::kCheck;
  say("[MSG:Enabled]\r\n");
  return 0;
}

int SimulatedController::unlock() {
  if (machine_.state != MachineState::kAlarm) return 0;
  if (machine_.door_open) return 13;
  say("[MSG:Caution: Unlocked]\r\n");
  machine_.alarm = 0;
  machine_.state = MachineState::kIdle;
  event("unlocked");
  return 0;
}

int SimulatedController::jog(const std::string& line) {
  if (!sim_state::takes_jog(machine_, motion())) return 8;
  if (line.size() < 3 || line[2] != '=') return 16;
  std::vector<SimAction> actions;
  SimGcode before = gcode_;
  if (const int error = before.jog(std::string_view(line).substr(3), actions); error != 0) {
    return error;
  }
  if (settings_.on(20) && beyond_travel(actions.back().move.target)) return 15;
  gcode_.set_position(actions.back().move.target);
  errand_.actions.assign(actions.begin(), actions.end());
  return 0;
}

/// Z first, then X and Y together, at the search rate; then off the switches and on again slowly.
int SimulatedController::home() {
  if (!settings_.on(22)) return 5;
  if (machine_.door_open) return 13;
  const Eigen::Vector3d travel = settings_.axes(130);
  const Eigen::Vector3d way = true_position().cwiseAbs().cwiseMin(travel);
  const double search = (way.z() + std::max(way.x(), way.y())) / settings_[25];
  const double locate = 2.0 * 3.0 * settings_[27] / settings_[24];
  machine_.state = MachineState::kHome;
  machine_.homing_until = options_.instant ? now_ : now_ + 60.0 * (search + locate);
  return -1;
}

int SimulatedController::sleep() {
  say("[MSG:Sleeping]\r\n");
  set_spindle(0, 0.0);
  answer(0);
  machine_.state = MachineState::kSleep;
  return -1;
}

int SimulatedController::restore(const std::string& line) {
  if (line != "$RST=$" && line != "$RST=#" && line != "$RST=*") return 3;
  if (line != "$RST=#") settings_.restore();
  if (line != "$RST=$") {
    for (int i = 0; i < 6; ++i) gcode_.set_origin(i, Eigen::Vector3d::Zero());
  }
  store();
  say("[MSG:Restoring defaults]\r\n");
  reset_after_answer_ = true;
  return 0;
}

int SimulatedController::startup_lines(const std::string& line) {
  if (line == "$N") {
    for (std::size_t i = 0; i < 2; ++i) {
      say(numbered("$N", static_cast<std::int64_t>(i)) + "=" + settings_.startup[i] + "\r\n");
    }
    return 0;
  }
  if (line.size() < 4 || (line[2] != '0' && line[2] != '1') || line[3] != '=') return 3;
  const std::string words = line.substr(4);
  SimGcode trial = gcode_;
  std::vector<SimAction> actions;
  if (const int error = trial.run(words, actions); error != 0) return error;
  settings_.startup[static_cast<std::size_t>(line[2] - '0')] = words;
  store();
  return 0;
}

int SimulatedController::write_setting(const std::string& line) {
  const std::size_t sign = line.find('=');
  if (sign == std::string::npos || sign < 2) return 3;
  const double number = number_in(line.substr(1, sign - 1));
  const double value = number_in(line.substr(sign + 1));
  if (std::isnan(number) || number < 0.0 || number > 1000.0) return 3;
  if (std::isnan(value)) return 2;
  const int error = settings_.set(static_cast<int>(number), value);
  if (error == 0) store();
  return error;
}

/// The board hears nothing while it writes.
void SimulatedController::store() {
  if (options_.instant) return;
  busy_until_ = deaf_until_ = now_ + options_.eeprom_seconds;
}

void SimulatedController::print_build() {
  const std::string sizes =
      std::to_string(options_.planner_blocks) + "," + std::to_string(options_.rx_bytes);
  if (is_hal()) {
    say(std::string("[VER:1.1f.20240101:]\r\n[OPT:VNMSL,").append(sizes).append(",3,0]\r\n"));
    say("[NEWOPT:ENUMS,RT+,TC]\r\n[FIRMWARE:grblHAL]\r\n");
    return;
  }
  std::string built = "V";
  if (options_.line_numbers) built += "N";
  if (options_.mist) built += "M";
  say(std::string("[VER:1.1h.20190830:]\r\n[OPT:").append(built) + "," + sizes + "]\r\n");
}

}  // namespace lensforge
