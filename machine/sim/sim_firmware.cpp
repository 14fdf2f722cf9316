// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_firmware.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "core/text/words.h"

namespace lensforge {

std::string fixed_text(double value, int decimals) {
  std::array<char, 64> digits{};
  // No negative zero, at whatever decimals.
  if (std::abs(value) < 0.5 * std::pow(10.0, -decimals)) value = 0.0;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                          std::chars_format::fixed, decimals);
  return error == std::errc() ? std::string(digits.data(), end) : "0";
}

std::string numbered(const std::string& word, std::int64_t number) {
  return word + std::to_string(number);
}

std::string fixed_text(const Eigen::Vector3d& value, int decimals) {
  return fixed_text(value.x(), decimals) + "," + fixed_text(value.y(), decimals) + "," +
         fixed_text(value.z(), decimals);
}

namespace {

/// A mill of 400 × 300 × 100 mm that homes to the top right corner.
std::map<int, double> mill_settings() {
  return {{0, 10},    {1, 25},    {2, 0},      {3, 0},     {4, 0},      {5, 0},      {6, 0},
          {10, 3},    {11, 0.02}, {12, 0.005}, {13, 0},    {20, 1},     {21, 0},     {22, 1},
          {23, 0},    {24, 100},  {25, 2000},  {26, 25},   {27, 2},     {30, 24000}, {31, 0},
          {32, 0},    {100, 800}, {101, 800},  {102, 800}, {110, 6000}, {111, 6000}, {112, 3000},
          {120, 500}, {121, 500}, {122, 300},  {130, 400}, {131, 300},  {132, 100}};
}

bool is_whole(int number) {
  static const std::set<int> kWhole{0, 1, 2, 3, 4, 5, 6, 10, 13, 20, 21, 22, 23, 26, 30, 31, 32};
  return kWhole.count(number) != 0;
}

}  // namespace

SimulatedOptions simulated_grbl() {
  SimulatedOptions options;
  options.line_numbers = true;
  options.settings = mill_settings();
  options.stands_at = {-150.0, -100.0, -20.0};
  return options;
}

SimulatedOptions simulated_grblhal() {
  SimulatedOptions options = simulated_grbl();
  options.firmware = SimulatedFirmware::kGrblHal;
  options.rx_bytes = 1024;
  options.planner_blocks = 35;
  options.line_seconds = 0.0002;
  options.eeprom_seconds = 0.0;
  options.mist = true;
  options.settings[10] = 511;
  return options;
}

SimSettings::SimSettings(const SimulatedOptions& options) : values_(mill_settings()) {
  for (const auto& [number, value] : options.settings) values_[number] = value;
  defaults_ = values_;
}

double SimSettings::operator[](int number) const {
  const auto found = values_.find(number);
  return found == values_.end() ? 0.0 : found->second;
}

Eigen::Vector3d SimSettings::axes(int first) const {
  return {(*this)[first], (*this)[first + 1], (*this)[first + 2]};
}

int SimSettings::set(int number, double value) {
  if (value < 0.0) return 4;
  const auto found = values_.find(number);
  if (found == values_.end()) return 3;
  if (number == 0 && value < 3.0) return 6;
  if (number == 20 && value != 0.0 && !on(22)) return 10;
  found->second = is_whole(number) ? std::floor(value) : value;
  if (number == 22 && value == 0.0) values_[20] = 0.0;
  return 0;
}

std::string SimSettings::text() const {
  std::string text;
  for (const auto& [number, value] : values_) {
    text.append("$").append(std::to_string(number)).append("=");
    text.append(fixed_text(value, is_whole(number) ? 0 : 3)).append("\r\n");
  }
  return text;
}

namespace {

/// Used-up bytes that are kept at most before the rest is moved to the front.
constexpr std::size_t kUsedUp = 4096;

SimIntake with_character(SimIntake intake, char c, std::size_t longest) {
  if (intake.comment != 0) {
    if (intake.comment == '(' && c == ')') intake.comment = 0;
    return intake;
  }
  if (c <= ' ' || c == '/') return intake;
  if (c == '(' || c == ';') {
    intake.comment = c;
  } else if (intake.line.size() >= longest) {
    intake.overflows = true;
  } else {
    intake.line += upper(c);
  }
  return intake;
}

}  // namespace

void SimBuffer::add(char byte) {
  if (empty() || read > kUsedUp) {
    bytes.erase(0, read);
    read = 0;
  }
  bytes += byte;
}

SimTaken taken(SimIntake intake, char c, const SimIntakeRules& rules) {
  if (c != '\n' && c != '\r') {
    intake.last_end = 0;
    return {with_character(std::move(intake), c, rules.longest), false};
  }
  const bool second = rules.crlf_is_one && intake.last_end != 0 && intake.last_end != c;
  intake.last_end = second ? '\0' : c;
  return {std::move(intake), !second};
}

namespace sim_state {
namespace {

bool runs(const SimState& now) {
  return now.state == MachineState::kRun || now.state == MachineState::kJog;
}

bool held(const SimState& now) {
  return now.state == MachineState::kHold || now.state == MachineState::kDoor;
}

bool is_over(double until, double time) { return until != SimState::kNever && time >= until; }

MachineState without_motion(const SimState& now) {
  return now.tool_acknowledged ? MachineState::kTool : MachineState::kIdle;
}

}  // namespace

bool moving(const SimState& now, const SimMotion& motion) {
  return (runs(now) || (held(now) && !now.stopped)) && !motion.at_stand();
}

bool suspended(const SimState& now) {
  return now.critical || held(now) || now.state == MachineState::kSleep ||
         now.state == MachineState::kHome ||
         (now.state == MachineState::kTool && !now.tool_acknowledged);
}

bool still(const SimState& now, const SimMotion& motion) {
  return (now.state == MachineState::kIdle || now.state == MachineState::kAlarm) && motion.empty;
}

bool takes_jog(const SimState& now, const SimMotion& motion) {
  return (now.state == MachineState::kIdle && motion.empty) || now.state == MachineState::kJog ||
         (now.state == MachineState::kTool && now.tool_acknowledged);
}

Due due(const SimState& now, const SimMotion& motion, double time) {
  if (is_over(now.homing_until, time)) return Due::kHomed;
  if (is_over(now.restoring_until, time)) return Due::kRestored;
  if (!now.stopped && motion.at_stand()) return Due::kStopped;
  if (runs(now) && motion.empty) return Due::kRanOut;
  const bool limit = now.limit_hit && now.state != MachineState::kAlarm;
  return limit && motion.at_stand() ? Due::kLimit : Due::kNothing;
}

Start on_cycle_start(const SimState& now) {
  if (now.state == MachineState::kTool) return Start::kLeaveTool;
  if (now.state == MachineState::kIdle) return Start::kBegin;
  if (!now.stopped) return Start::kNothing;
  if (now.state == MachineState::kHold) return Start::kResume;
  const bool shut = now.state == MachineState::kDoor && !now.door_open;
  const bool restoring = now.restoring_until != SimState::kNever;
  return shut && !restoring ? Start::kRestoreSpindle : Start::kNothing;
}

Hold on_feed_hold(const SimState& now) {
  if (now.state == MachineState::kJog) return Hold::kCancelJog;
  const bool holds = now.state == MachineState::kIdle || now.state == MachineState::kRun;
  return holds ? Hold::kStop : Hold::kNothing;
}

Door on_door(const SimState& now) {
  switch (now.state) {
    case MachineState::kHome:
      return Door::kAlarm;
    case MachineState::kAlarm:
    case MachineState::kCheck:
    case MachineState::kSleep:
      return Door::kNothing;
    default:
      return Door::kStop;
  }
}

int alarm_of_reset(const SimState& now) {
  if (now.state == MachineState::kHome) return 6;
  return runs(now) || !now.stopped ? 3 : 0;
}

SimState stopping(SimState now, MachineState shown, bool moves) {
  if (!held(now)) now.stopped = !moves;
  now.state = shown;
  return now;
}

SimState cancelling(SimState now) {
  now.stopped = false;
  return now;
}

SimState resumed(SimState now, const SimMotion& motion) {
  now.restoring_until = SimState::kNever;
  now.state = motion.empty ? MachineState::kIdle : MachineState::kRun;
  return now;
}

SimState ran_out(SimState now) {
  now.state = without_motion(now);
  return now;
}

SimState alarmed(SimState now, int code) {
  now.homing_until = now.restoring_until = SimState::kNever;
  now.stopped = true;
  now.state = MachineState::kAlarm;
  now.alarm = code;
  now.critical = code == 1 || code == 2;
  return now;
}

SimState homed(SimState now) {
  now.homed = true;
  now.alarm = 0;
  now.state = MachineState::kIdle;
  return now;
}

SimState restarted(SimState now) {
  now.tool_acknowledged = now.critical = now.limit_hit = false;
  now.stopped = true;
  now.homing_until = now.restoring_until = SimState::kNever;
  const bool locked = now.state == MachineState::kAlarm || now.state == MachineState::kSleep;
  now.state = locked ? MachineState::kAlarm : MachineState::kIdle;
  return now;
}

std::string text(const SimState& now, bool hal, double time) {
  switch (now.state) {
    case MachineState::kIdle:
      return "Idle";
    case MachineState::kRun:
      return "Run";
    case MachineState::kHold:
      return now.stopped ? "Hold:0" : "Hold:1";
    case MachineState::kJog:
      return "Jog";
    case MachineState::kAlarm:
      return hal && now.alarm != 0 ? numbered("Alarm:", now.alarm) : "Alarm";
    case MachineState::kDoor:
      if (now.restoring_until > time) return "Door:3";
      if (!now.stopped) return "Door:2";
      return now.door_open ? "Door:1" : "Door:0";
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

}  // namespace sim_state

namespace {

// Reports between two that carry the field, at rest and in motion.
constexpr int kOffsetAtRest = 10;
constexpr int kOffsetInMotion = 30;
constexpr int kOverrideAtRest = 10;
constexpr int kOverrideInMotion = 20;

constexpr double kInch = 25.4;  ///< mm

double changed(double value, double by) {
  return by == 0.0 ? 100.0 : std::clamp(value + by, 10.0, 200.0);
}

std::string coordinates(const SimSnapshot& machine, const Eigen::Vector3d& point) {
  return machine.inches ? fixed_text(Eigen::Vector3d(point / kInch), 4) : fixed_text(point, 3);
}

std::string override_text(const SimSnapshot& machine) {
  std::string text("|Ov:");
  text.append(fixed_text(machine.overrides.feed, 0)).append(",");
  text.append(fixed_text(machine.overrides.rapid, 0)).append(",");
  text.append(fixed_text(machine.overrides.spindle, 0));
  std::string accessories;
  if (machine.spindle != 0) accessories += machine.spindle > 0 ? "S" : "C";
  if ((machine.coolant & 2) != 0) accessories += "F";
  if ((machine.coolant & 1) != 0) accessories += "M";
  if (!accessories.empty()) text.append("|A:").append(accessories);
  return text;
}

/// Offsets and overrides are sent at intervals, never in the same report.
SimReport extras(const SimSnapshot& machine, SimCountdowns countdowns) {
  if (countdowns.offset-- <= 0) {
    countdowns.offset = (machine.rests ? kOffsetAtRest : kOffsetInMotion) - 1;
    if (countdowns.overrides <= 0) countdowns.overrides = 1;
    return {std::string("|WCO:").append(coordinates(machine, machine.offset)), countdowns};
  }
  if (--countdowns.overrides > 0) return {"", countdowns};
  countdowns.overrides = machine.rests ? kOverrideAtRest : kOverrideInMotion;
  return {override_text(machine), countdowns};
}

}  // namespace

std::optional<SimOverrides> overridden(SimOverrides before, unsigned char byte) {
  constexpr double kSteps[] = {0.0, 10.0, -10.0, 1.0, -1.0};
  if (byte >= 0x90 && byte <= 0x94) {
    before.feed = changed(before.feed, kSteps[byte - 0x90]);
  } else if (byte >= 0x95 && byte <= 0x97) {
    before.rapid = byte == 0x95 ? 100.0 : byte == 0x96 ? 50.0 : 25.0;
  } else if (byte >= 0x99 && byte <= 0x9D) {
    before.spindle = changed(before.spindle, kSteps[byte - 0x99]);
  } else {
    return std::nullopt;
  }
  return before;
}

SimReport report_of(const SimSnapshot& machine, SimCountdowns countdowns) {
  const bool absolute = (machine.mask & 1) != 0;
  const Eigen::Vector3d work = machine.position - machine.offset;
  std::string text("<");
  text.append(machine.state).append(absolute ? "|MPos:" : "|WPos:");
  text.append(coordinates(machine, absolute ? machine.position : work));
  if ((machine.mask & 2) != 0) {
    text.append("|Bf:").append(std::to_string(machine.free_blocks)).append(",");
    text.append(std::to_string(machine.free_bytes));
  }
  if (machine.number > 0) text.append("|Ln:").append(std::to_string(machine.number));
  const double speed = machine.speed * 60.0 / (machine.inches ? kInch : 1.0);
  text.append("|FS:").append(fixed_text(speed, 0)).append(",").append(fixed_text(machine.rpm, 0));
  if (machine.door_open) text.append("|Pn:D");
  SimReport more = extras(machine, countdowns);
  return {text + more.text + ">\r\n", more.next};
}

}  // namespace lensforge
