// SPDX-License-Identifier: GPL-3.0-or-later
// Lines: from characters to motions and answers.
#include <algorithm>
#include <utility>

#include "machine/sim/sim_text.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {
namespace {

constexpr std::size_t kGrblLine = 79;
constexpr std::size_t kHalLine = 256;

}  // namespace

/// One step of the firmware's main loop. @return whether anything was done.
bool SimulatedController::step_parser() {
  if (sim_state::suspended(machine_) || now_ < busy_until_) return false;
  if (!errand_.actions.empty()) return run_action();
  if (errand_.answer) {
    errand_.answer = false;
    answer(0);
    return true;
  }
  if (line_waits_) {
    line_waits_ = false;
    run_line();
    return true;
  }
  return read_characters();
}

bool SimulatedController::read_characters() {
  const SimIntakeRules rules{is_hal() ? kHalLine : kGrblLine, is_hal()};
  while (!rx_.empty()) {
    SimTaken next = taken(std::move(intake_), rx_.bytes[rx_.read++], rules);
    intake_ = std::move(next.intake);
    if (!next.ended) continue;
    line_waits_ = true;
    const bool free = options_.instant || intake_.line.empty();
    busy_until_ = now_ + (free ? 0.0 : options_.line_seconds);
    return true;
  }
  return false;
}

void SimulatedController::run_line() {
  const SimIntake came = std::exchange(intake_, SimIntake{{}, false, 0, intake_.last_end});
  const std::string& line = came.line;
  errand_.received = ++received_;
  errand_.chord = 0;
  int error = 0;
  if (came.overflows) {
    error = 11;
  } else if (!line.empty() && line[0] == '$') {
    error = run_system(line);
  } else if (!line.empty()) {
    error = run_gcode(line);
  }
  last_error_ = std::max(error, 0);
  if (error > 0) return answer(error);
  errand_.answer = error == 0;  // else it answers later by itself
}

int SimulatedController::run_gcode(const std::string& line) {
  if (machine_.state == MachineState::kAlarm || machine_.state == MachineState::kJog) return 9;
  if (is_hal() && last_error_ != 0) return last_error_;
  if (scripted_error_ != 0) {
    const int error = scripted_error_;
    scripted_error_ = 0;
    return error;
  }
  if (machine_.state == MachineState::kTool) return 40;
  std::vector<SimAction> actions;
  if (const int error = gcode_.run(line, actions); error != 0) return error;
  errand_.actions.assign(actions.begin(), actions.end());
  return 0;
}

void SimulatedController::answer(int error) {
  if (error != 0) {
    event(numbered("error ", error));
    return say(numbered("error:", error) + "\r\n");
  }
  say("ok\r\n");
  if (reset_after_answer_) restart();
}

void SimulatedController::wait(double seconds) {
  if (!options_.instant) busy_until_ = now_ + seconds;
}

/// The first action of the line. @return whether it, or a part of it, was done.
bool SimulatedController::run_action() {
  const SimAction action = errand_.actions.front();
  if (action.kind == SimAction::Kind::kMove) return queue_move(action);
  const bool stands_first =
      action.kind == SimAction::Kind::kSync || action.kind == SimAction::Kind::kStore;
  if (stands_first && !queue_.empty()) {
    begin_motion();
    return false;
  }
  errand_.actions.pop_front();
  carry_out(action);
  return true;
}

/// What takes no place in the queue.
void SimulatedController::carry_out(const SimAction& action) {
  const bool checks = machine_.state == MachineState::kCheck;
  switch (action.kind) {
    case SimAction::Kind::kDwell:
      if (!checks) wait(action.value);
      break;
    case SimAction::Kind::kSpindle: {
      const double rpm = std::clamp(action.value, settings_[31], settings_[30]);
      if (!checks) set_spindle(action.turn, action.turn == 0 ? 0.0 : rpm);
      countdowns_.overrides = 0;
      break;
    }
    case SimAction::Kind::kCoolant:
      if (!checks) coolant_ = action.turn;
      countdowns_.overrides = 0;
      break;
    case SimAction::Kind::kTool:
      event(numbered("tool ", static_cast<int>(action.value)));
      if (!checks) machine_.state = MachineState::kTool;
      break;
    case SimAction::Kind::kPause:
      if (!checks) feed_hold();
      break;
    case SimAction::Kind::kEnd:
      return end_program();
    case SimAction::Kind::kStore:
      store();
      break;
    default:
      break;
  }
}

void SimulatedController::end_program() {
  if (machine_.state != MachineState::kCheck) set_spindle(0, 0.0);
  coolant_ = 0;
  set_overrides({});
  say("[MSG:Pgm End]\r\n");
  event("end");
}

bool SimulatedController::queue_move(const SimAction& action) {
  if (queue_.room() == 0) {
    begin_motion();
    return false;
  }
  SimMove move = action.move;
  move.received = errand_.received;
  bool last = true;
  if (action.arc) {
    ++errand_.chord;
    last = errand_.chord >= action.arc->chords;
    move.target = action.arc->chord_end(errand_.chord);
  }
  if (settings_.on(20) && !move.jog && beyond_travel(move.target)) {
    // The motion that runs comes to its stand first; the line is never answered.
    errand_ = Errand();
    machine_.limit_hit = machine_.critical = true;
    if (!queue_.empty()) queue_.hold();
    return true;
  }
  if (last) {
    errand_.actions.pop_front();
    errand_.chord = 0;
  }
  if (machine_.state == MachineState::kCheck) return true;
  queue_.now = now_;
  queue_.push(move);
  if (move.jog && !queue_.empty()) machine_.state = MachineState::kJog;
  if (options_.instant) queue_.finish_now();
  return true;
}

bool SimulatedController::beyond_travel(const Eigen::Vector3d& target) const {
  constexpr double kRounding = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const double travel = settings_[130 + axis];
    if (target[axis] > kRounding || target[axis] < -travel - kRounding) return true;
  }
  return false;
}

void SimulatedController::run_startup_lines() {
  std::vector<SimAction> actions;
  for (const std::string& line : settings_.startup) {
    if (line.empty()) continue;
    const int error = gcode_.run(line, actions);
    std::string text(">");
    text.append(line).append(error == 0 ? ":ok" : numbered(":error:", error)).append("\r\n");
    say(text);
  }
  errand_.actions.assign(actions.begin(), actions.end());
}

}  // namespace lensforge
