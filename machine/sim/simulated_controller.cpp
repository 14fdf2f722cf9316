// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_controller.h"

#include <algorithm>
#include <cmath>

#include "machine/sim/sim_text.h"

namespace lensforge {
namespace {

constexpr double kNever = -1.0;
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
  homed_ = false;
  state_ = settings_.on(22) ? MachineState::kAlarm : MachineState::kIdle;
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
  door_open_ = false;
  power_up();
}

/// What every reset does: buffers empty, modes as new, greeting; an alarm stays.
void SimulatedController::restart() {
  queue_.clear();
  gcode_.reset();
  gcode_.set_position(queue_.position());
  rx_.clear();
  rx_read_ = 0;
  line_.clear();
  line_overflows_ = line_waits_ = false;
  comment_ = 0;
  errand_ = saved_errand_ = Errand();
  tool_acknowledged_ = critical_ = limit_hit_ = reset_after_answer_ = false;
  stopped_ = true;
  last_error_ = 0;
  busy_until_ = now_;
  homing_until_ = restoring_until_ = kNever;
  feed_override_ = rapid_override_ = spindle_override_ = 100.0;
  queue_.set_overrides(100.0, 100.0);
  offset_countdown_ = 0;
  override_countdown_ = 1;
  coolant_ = 0;
  say(is_hal() ? "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n"
               : "\r\nGrbl 1.1h ['$' for help]\r\n");
  if (state_ == MachineState::kAlarm || state_ == MachineState::kSleep) {
    state_ = MachineState::kAlarm;
    say("[MSG:'$H'|'$X' to unlock]\r\n");
    return;
  }
  state_ = MachineState::kIdle;
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
    for (const double timer : {busy_until_, homing_until_, restoring_until_}) {
      if (timer > now_) step = std::min(step, timer - now_);
    }
    const double target = now_ + step;
    queue_.now = now_;
    if (moving()) step = queue_.run(step);
    const bool whole = now_ + step >= target - 1e-12;
    now_ = whole ? target : now_ + step;
  }
}

bool SimulatedController::moving() const {
  const bool runs = state_ == MachineState::kRun || state_ == MachineState::kJog;
  const bool stops = (state_ == MachineState::kHold || state_ == MachineState::kDoor) && !stopped_;
  return (runs || stops) && !queue_.empty() && !(queue_.holding() && queue_.stands());
}

bool SimulatedController::suspended() const {
  return critical_ || state_ == MachineState::kHold || state_ == MachineState::kDoor ||
         state_ == MachineState::kSleep || state_ == MachineState::kHome ||
         (state_ == MachineState::kTool && !tool_acknowledged_);
}

/// Everything that can happen at this moment.
void SimulatedController::work() {
  while (settle() || step_parser()) {
  }
  // Nothing more to read: what is queued begins to run.
  if (rx_read_ == rx_.size() && !line_waits_) start_motion();
}

bool SimulatedController::settle() {
  if (settle_timer()) return true;
  const bool stands = queue_.empty() || (queue_.holding() && queue_.stands());
  if (!stopped_ && stands) {
    finish_stop();
    return true;
  }
  const bool runs = state_ == MachineState::kRun || state_ == MachineState::kJog;
  if (runs && queue_.empty()) {
    state_ = tool_acknowledged_ ? MachineState::kTool : MachineState::kIdle;
    return true;
  }
  if (limit_hit_ && stands && state_ != MachineState::kAlarm) {
    limit_hit_ = false;
    raise_alarm(2);
    return true;
  }
  return false;
}

bool SimulatedController::settle_timer() {
  if (homing_until_ != kNever && now_ >= homing_until_) {
    finish_homing();
    return true;
  }
  if (restoring_until_ != kNever && now_ >= restoring_until_) {
    restoring_until_ = kNever;
    queue_.resume();
    state_ = queue_.empty() ? MachineState::kIdle : MachineState::kRun;
    event("resume");
    return true;
  }
  return false;
}

void SimulatedController::start_motion() {
  if (state_ == MachineState::kIdle && !queue_.empty()) state_ = MachineState::kRun;
}

/// Slows down to a stand; `state` is what is shown from now on.
void SimulatedController::stop_for(MachineState state) {
  const bool moves = moving();
  if (state_ != MachineState::kHold && state_ != MachineState::kDoor) stopped_ = !moves;
  if (moves) queue_.hold();
  state_ = state;
}

void SimulatedController::finish_stop() {
  stopped_ = true;
  if (state_ == MachineState::kDoor) {
    door_spindle_ = queue_.spindle;
    door_rpm_ = queue_.rpm;
    set_spindle(0, 0.0);
  }
  if (state_ == MachineState::kJog) {
    queue_.clear();
    errand_.actions.clear();
    gcode_.set_position(queue_.position());
    state_ = tool_acknowledged_ ? MachineState::kTool : MachineState::kIdle;
  }
}

void SimulatedController::feed_hold() {
  switch (state_) {
    case MachineState::kJog:
      return cancel_jog();
    case MachineState::kIdle:
    case MachineState::kRun:
      stop_for(MachineState::kHold);
      return event("hold");
    default:
      return;
  }
}

void SimulatedController::cancel_jog() {
  if (state_ != MachineState::kJog) return;
  queue_.hold();
  stopped_ = false;
}

void SimulatedController::cycle_start() {
  if (state_ == MachineState::kTool) return leave_tool();
  if (state_ == MachineState::kIdle) return start_motion();
  const bool door = state_ == MachineState::kDoor && !door_open_;
  if (!stopped_ || (state_ != MachineState::kHold && !door)) return;
  if (door && restoring_until_ == kNever) {
    const bool turns = door_spindle_ != 0 && !options_.instant;
    set_spindle(door_spindle_, door_rpm_);
    restoring_until_ = now_ + (turns ? kSpindleRestore : 0.0);
    return;
  }
  if (state_ == MachineState::kDoor) return;
  queue_.resume();
  state_ = queue_.empty() ? MachineState::kIdle : MachineState::kRun;
  event("resume");
}

void SimulatedController::move_door(bool open) {
  door_open_ = open;
  if (!open) return;
  event("door");
  switch (state_) {
    case MachineState::kHome:
      return raise_alarm(7);
    case MachineState::kAlarm:
    case MachineState::kCheck:
    case MachineState::kSleep:
      return;
    default:
      say("[MSG:Check Door]\r\n");
      restoring_until_ = kNever;
      const bool in_door = state_ == MachineState::kDoor;
      stop_for(MachineState::kDoor);
      if (stopped_ && (!in_door || queue_.spindle != 0)) finish_stop();
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

void SimulatedController::soft_reset() {
  const bool homing = state_ == MachineState::kHome;
  const bool motion = state_ == MachineState::kRun || state_ == MachineState::kJog || !stopped_;
  event("reset");
  set_spindle(0, 0.0);
  if (homing) return raise_alarm(6);
  if (motion) return raise_alarm(3);
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
  homing_until_ = restoring_until_ = kNever;
  stopped_ = true;
  state_ = MachineState::kAlarm;
  alarm_ = code;
  event(numbered("alarm ", code));
  say(numbered("ALARM:", code) + "\r\n");
  critical_ = code == 1 || code == 2;
  if (critical_) {
    say("[MSG:Reset to continue]\r\n");
  } else {
    restart();
  }
}

void SimulatedController::finish_homing() {
  homing_until_ = kNever;
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
  homed_ = true;
  alarm_ = 0;
  state_ = MachineState::kIdle;
  event("homed");
  answer(0);
  run_startup_lines();
}

/// Other lines run beside the tool change until the operator goes on.
void SimulatedController::acknowledge_tool() {
  if (state_ != MachineState::kTool || tool_acknowledged_) return;
  tool_acknowledged_ = true;
  saved_errand_ = errand_;
  errand_ = Errand();
  saved_rx_ = rx_.substr(rx_read_);
  rx_.clear();
  rx_read_ = 0;
}

void SimulatedController::leave_tool() {
  if (tool_acknowledged_) {
    tool_acknowledged_ = false;
    errand_ = saved_errand_;
    rx_ = saved_rx_;
    rx_read_ = 0;
  }
  state_ = MachineState::kIdle;
  event("resume");
}

}  // namespace lensforge
