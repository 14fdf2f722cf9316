// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_controller.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "machine/sim/sim_firmware.h"

namespace lensforge {
namespace {

constexpr double kSpindleRestore = 4.0;  ///< s, after a door (Grbl's SAFETY_DOOR_SPINDLE_DELAY).
/// A mill whose pulses stop abruptly coasts for about this long: steps are lost.
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

/// Common part of all resets: empties buffers, resets modes, sends the banner; an alarm stays.
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
  // Nothing more to read: the queue starts to run.
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

/// Other lines run during the tool change until the operator resumes.
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

// Bytes from the wire: the receive buffer, and the commands that go past it.

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

/// True if the byte was a command or does not belong to the line.
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

// Lines: from characters to motions and answers.

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

/// Actions that need no place in the queue.
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
    // The running motion stops first; the line is never answered.
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

// Lines that begin with $.

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

/// The board loses bytes while it writes.
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
