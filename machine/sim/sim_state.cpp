// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_state.h"

#include "machine/sim/sim_text.h"

namespace lensforge::sim_state {
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

}  // namespace lensforge::sim_state
