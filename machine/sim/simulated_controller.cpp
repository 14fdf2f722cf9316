// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_controller.h"

#include <algorithm>
#include <cmath>

#include "machine/sim/sim_text.h"

namespace lensforge {
namespace {

constexpr double kSpindleRestore = 4.0;  ///< s, after a door (Grbl's SAFETY_DOOR_SPINDLE_DELAY).
/// A mill whose pulses end at once goes on for about this long: steps are lost.
constexpr double kCoasting = 0.01;  ///< s

}  // namespace

SimulatedController::SimulatedController(const SimulatedOptions& options, const MachineWatch& watch)
    : options_(options),
      watch_(watch),
      settings_(options),
      queue_(settings_, options.planner_blocks),
      gcode_(settings_, options_) {
  slip_ = options_.stands_at;
  const auto tell = [this](const std::function<void(const ExecutedPiece&)>& whom,
                           const ExecutedPiece& piece) {
    if (!whom) return;
    ExecutedPiece truly = piece;
    truly.start += slip_;
    truly.end += slip_;
    whom(truly);
  };
  queue_.ended = [this, tell](const ExecutedPiece& piece) { tell(watch_.piece, piece); };
  queue_.begun = [this, tell](const ExecutedPiece& piece) { tell(watch_.begins, piece); };
  power_up();
}

void SimulatedController::power_up() {
  machine_.homed = false;
  machine_.state = settings_.on(22) ? MachineState::kAlarm : MachineState::kIdle;
  event("power up");
  restart();
}

/// The mill stays where it is; the controller starts to count anew.
void SimulatedController::power_cycle() {
  if (moving()) lose_steps();
  queue_.clear();
  slip_ += queue_.position();
  queue_.set_position(Eigen::Vector3d::Zero());
  set_spindle(0, 0.0);
  output_.clear();
  machine_.door_open = false;
  power_up();
}

/// What every reset does: buffers empty, modes as new, greeting; an alarm stays.
void SimulatedController::restart() {
  queue_.clear();
  gcode_.reset();
  gcode_.set_position(queue_.position());
  rx_ = SimBuffer();
  intake_ = {{}, false, 0, intake_.last_end};
  line_waits_ = reset_after_answer_ = false;
  errand_ = saved_errand_ = Errand();
  machine_ = sim_state::restarted(machine_);
  last_error_ = 0;
  busy_until_ = now_;
  set_overrides({});
  countdowns_ = {};
  coolant_ = 0;
  say(is_hal() ? "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n"
               : "\r\nGrbl 1.1h ['$' for help]\r\n");
  if (machine_.state == MachineState::kAlarm) return say("[MSG:'$H'|'$X' to unlock]\r\n");
  run_startup_lines();
}

void SimulatedController::event(const std::string& what) {
  if (watch_.event) watch_.event({now_, what});
}

std::vector<Spoken> SimulatedController::take_output() {
  std::vector<Spoken> taken;
  taken.swap(output_);
  return taken;
}

double SimulatedController::run_until(double time) {
  const std::size_t said = output_.size();
  for (;;) {
    work();
    if (output_.size() > said || now_ >= time) return now_;
    double step = time - now_;
    for (const double timer : {busy_until_, machine_.homing_until, machine_.restoring_until}) {
      if (timer > now_) step = std::min(step, timer - now_);
    }
    const double target = now_ + step;
    queue_.now = now_;
    if (moving()) step = queue_.run(step);
    const bool whole = now_ + step >= target - 1e-12;
    now_ = whole ? target : now_ + step;
  }
}

/// Everything that can happen at this moment.
void SimulatedController::work() {
  while (settle() || step_parser()) {
  }
  // Nothing more to read: what is queued begins to run.
  if (rx_.empty() && !line_waits_) begin_motion();
}

/// @return whether anything was due.
bool SimulatedController::settle() {
  switch (sim_state::due(machine_, motion(), now_)) {
    case sim_state::Due::kNothing:
      return false;
    case sim_state::Due::kHomed:
      finish_homing();
      break;
    case sim_state::Due::kRestored:
      resume();
      break;
    case sim_state::Due::kStopped:
      finish_stop();
      break;
    case sim_state::Due::kRanOut:
      machine_ = sim_state::ran_out(machine_);
      break;
    case sim_state::Due::kLimit:
      machine_.limit_hit = false;
      raise_alarm(2);
      break;
  }
  return true;
}

void SimulatedController::begin_motion() {
  const bool waits = machine_.state == MachineState::kIdle && !queue_.empty();
  if (waits) machine_.state = MachineState::kRun;
}

void SimulatedController::resume() {
  queue_.resume();
  machine_ = sim_state::resumed(machine_, motion());
  event("resume");
}

void SimulatedController::stop_for(MachineState state) {
  const bool moves = moving();
  machine_ = sim_state::stopping(machine_, state, moves);
  if (moves) queue_.hold();
}

void SimulatedController::finish_stop() {
  machine_.stopped = true;
  if (machine_.state == MachineState::kDoor) {
    machine_.door_spindle = queue_.spindle;
    machine_.door_rpm = queue_.rpm;
    set_spindle(0, 0.0);
  }
  if (machine_.state == MachineState::kJog) {
    queue_.clear();
    errand_.actions.clear();
    gcode_.set_position(queue_.position());
    machine_ = sim_state::ran_out(machine_);
  }
}

void SimulatedController::feed_hold() {
  switch (sim_state::on_feed_hold(machine_)) {
    case sim_state::Hold::kNothing:
      return;
    case sim_state::Hold::kCancelJog:
      return cancel_jog();
    case sim_state::Hold::kStop:
      stop_for(MachineState::kHold);
      return event("hold");
  }
}

void SimulatedController::cancel_jog() {
  if (machine_.state != MachineState::kJog) return;
  queue_.hold();
  machine_ = sim_state::cancelling(machine_);
}

void SimulatedController::cycle_start() {
  switch (sim_state::on_cycle_start(machine_)) {
    case sim_state::Start::kNothing:
      return;
    case sim_state::Start::kLeaveTool:
      return leave_tool();
    case sim_state::Start::kBegin:
      return begin_motion();
    case sim_state::Start::kResume:
      return resume();
    case sim_state::Start::kRestoreSpindle:
      const bool turns = machine_.door_spindle != 0 && !options_.instant;
      set_spindle(machine_.door_spindle, machine_.door_rpm);
      machine_.restoring_until = now_ + (turns ? kSpindleRestore : 0.0);
  }
}

void SimulatedController::move_door(bool open) {
  machine_.door_open = open;
  if (!open) return;
  event("door");
  switch (sim_state::on_door(machine_)) {
    case sim_state::Door::kNothing:
      return;
    case sim_state::Door::kAlarm:
      return raise_alarm(7);
    case sim_state::Door::kStop:
      say("[MSG:Check Door]\r\n");
      machine_.restoring_until = SimState::kNever;
      const bool in_door = machine_.state == MachineState::kDoor;
      stop_for(MachineState::kDoor);
      if (machine_.stopped && (!in_door || queue_.spindle != 0)) finish_stop();
  }
}

void SimulatedController::lose_steps() { slip_ += queue_.direction() * queue_.speed() * kCoasting; }

void SimulatedController::set_spindle(int turn, double rpm) {
  if (turn != queue_.spindle || rpm != queue_.rpm) {
    event(numbered("spindle ", turn) + " " + fixed_text(rpm, 0));
  }
  queue_.spindle = turn;
  queue_.rpm = turn == 0 ? 0.0 : rpm;
}

void SimulatedController::set_overrides(const SimOverrides& overrides) {
  overrides_ = overrides;
  queue_.set_overrides(overrides.feed, overrides.rapid);
}

void SimulatedController::soft_reset() {
  const int alarm = sim_state::alarm_of_reset(machine_);
  event("reset");
  set_spindle(0, 0.0);
  if (alarm != 0) return raise_alarm(alarm);
  restart();
}

/// Everything ends at once. Limits lock the controller until a reset; what else there is comes
/// with a reset of its own.
void SimulatedController::raise_alarm(int code) {
  if (moving()) lose_steps();
  queue_.now = now_;
  queue_.clear();
  gcode_.set_position(queue_.position());
  set_spindle(0, 0.0);
  gcode_.stop_spindle();
  errand_ = Errand();
  machine_ = sim_state::alarmed(machine_, code);
  event(numbered("alarm ", code));
  say(numbered("ALARM:", code) + "\r\n");
  if (machine_.critical) return say("[MSG:Reset to continue]\r\n");
  restart();
}

void SimulatedController::finish_homing() {
  machine_.homing_until = SimState::kNever;
  if (scripted_homing_ != 0) {
    const int alarm = scripted_homing_;
    scripted_homing_ = 0;
    return raise_alarm(alarm);
  }
  Eigen::Vector3d home;
  const int inverted = static_cast<int>(settings_[23]);
  for (int axis = 0; axis < 3; ++axis) {
    const bool low = ((inverted >> axis) & 1) != 0;
    home[axis] = low ? settings_[27] - settings_[130 + axis] : -settings_[27];
  }
  queue_.set_position(home);
  gcode_.set_position(home);
  slip_.setZero();
  machine_ = sim_state::homed(machine_);
  event("homed");
  answer(0);
  run_startup_lines();
}

/// Other lines run beside the tool change until the operator goes on.
void SimulatedController::acknowledge_tool() {
  if (machine_.state != MachineState::kTool || machine_.tool_acknowledged) return;
  machine_.tool_acknowledged = true;
  saved_errand_ = errand_;
  errand_ = Errand();
  saved_rx_ = rx_.rest();
  rx_ = SimBuffer();
}

void SimulatedController::leave_tool() {
  if (machine_.tool_acknowledged) {
    machine_.tool_acknowledged = false;
    errand_ = saved_errand_;
    rx_ = {saved_rx_, 0};
  }
  machine_.state = MachineState::kIdle;
  event("resume");
}

}  // namespace lensforge
