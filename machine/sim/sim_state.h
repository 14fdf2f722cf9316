// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Bytes that were received and not read yet.
struct SimBuffer {
  std::string bytes;
  std::size_t read = 0;  ///< Those of `bytes` that are used up.

  [[nodiscard]] bool empty() const { return read == bytes.size(); }
  [[nodiscard]] std::size_t size() const { return bytes.size() - read; }
  [[nodiscard]] std::string_view rest() const { return std::string_view(bytes).substr(read); }
  /// Puts a byte behind the others.
  void add(char byte);
};

/// The line in the making: what is left of the characters that came.
struct SimIntake {
  std::string line;
  bool overflows = false;
  char comment = 0;   ///< '(' or ';' while in one.
  char last_end = 0;  ///< CR or LF, if that was the last character.
};

/// How a firmware takes lines in.
struct SimIntakeRules {
  std::size_t longest = 79;  ///< Characters that count.
  bool crlf_is_one = false;  ///< grblHAL takes CR LF for one end; Grbl the second for a line.
};

/// A character comes. `ended` says whether it ends the line.
struct SimTaken {
  SimIntake intake;
  bool ended = false;
};
SimTaken taken(SimIntake intake, char c, const SimIntakeRules& rules);

/// States as reports name them.
enum class MachineState { kIdle, kRun, kHold, kJog, kAlarm, kDoor, kCheck, kHome, kSleep, kTool };

/// What the firmware takes its machine to be doing. Times in s of the simulation.
struct SimState {
  static constexpr double kNever = -1.0;

  MachineState state = MachineState::kIdle;
  int alarm = 0;           ///< Last one, for grblHAL's reports.
  bool critical = false;   ///< Nothing but a reset helps.
  bool stopped = true;     ///< A hold or a door has come to its stand.
  bool door_open = false;  ///< The switch, not the state.
  bool limit_hit = false;  ///< A line asked for more than the travel: stop, then alarm 2.
  bool homed = false;
  bool tool_acknowledged = false;   ///< Other lines run beside the tool change.
  double restoring_until = kNever;  ///< Spindle after a door.
  double homing_until = kNever;
  int door_spindle = 0;  ///< To be restored after a door.
  double door_rpm = 0.0;
};

/// What the queue of motions is at.
struct SimMotion {
  bool empty = true;
  bool holding = false;
  bool stands = true;  ///< At speed 0.

  [[nodiscard]] bool at_stand() const { return empty || (holding && stands); }
};

/// The firmware's decisions and changes of state as functions of values: what happens to queue,
/// spindle and output with them is the controller's.
namespace sim_state {

/// Whether the mill moves.
bool moving(const SimState& now, const SimMotion& motion);
/// Whether no line is taken.
bool suspended(const SimState& now);
/// Whether nothing moves or holds, so that most `$` lines are taken.
bool still(const SimState& now, const SimMotion& motion);
bool takes_jog(const SimState& now, const SimMotion& motion);

/// What has come to pass and is to be dealt with next.
enum class Due {
  kNothing,
  kHomed,
  kRestored,  ///< The spindle turns again after a door.
  kStopped,   ///< A hold, a door or a cancelled jog has come to its stand.
  kRanOut,    ///< Nothing is left to run.
  kLimit,     ///< The motion before a line beyond the travel has ended.
};
Due due(const SimState& now, const SimMotion& motion, double time);

/// What a cycle start brings about.
enum class Start { kNothing, kLeaveTool, kBegin, kRestoreSpindle, kResume };
Start on_cycle_start(const SimState& now);

/// What a feed hold brings about.
enum class Hold { kNothing, kCancelJog, kStop };
Hold on_feed_hold(const SimState& now);

/// What an opened door brings about.
enum class Door { kNothing, kAlarm, kStop };
Door on_door(const SimState& now);

/// The alarm that a soft reset brings, or 0.
int alarm_of_reset(const SimState& now);

/// Slows down to a stand; `shown` is the state from now on.
SimState stopping(SimState now, MachineState shown, bool moves);
/// A jog slows down to its end.
SimState cancelling(SimState now);
/// Goes on with what is queued.
SimState resumed(SimState now, const SimMotion& motion);
/// Nothing runs any more.
SimState ran_out(SimState now);
/// Everything has ended at once.
SimState alarmed(SimState now, int code);
SimState homed(SimState now);
/// After any reset: alarms stay, also through sleep.
SimState restarted(SimState now);

/// "Run", "Hold:0". @param hal  as grblHAL writes it.
std::string text(const SimState& now, bool hal, double time);

}  // namespace sim_state

/// Percent of what the program asks for.
struct SimOverrides {
  double feed = 100.0;
  double rapid = 100.0;
  double spindle = 100.0;
};

/// What a realtime byte makes of them; nothing if it is no override.
std::optional<SimOverrides> overridden(SimOverrides before, unsigned char byte);

/// Reports until the next WCO and the next Ov.
struct SimCountdowns {
  int offset = 0;
  int overrides = 1;
};

/// What a status report is written from. Lengths in mm, times in s.
struct SimSnapshot {
  std::string state;
  bool rests = true;  ///< Idle or in alarm: some fields come more often.
  int mask = 0;       ///< $10
  bool inches = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Of the machine.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();    ///< Machine − work.
  int free_blocks = 0;
  std::size_t free_bytes = 0;
  std::int64_t number = 0;  ///< N word of what runs; 0 for none.
  double speed = 0.0;
  double rpm = 0.0;
  bool door_open = false;
  SimOverrides overrides;
  int spindle = 0;  ///< +1, −1, 0
  int coolant = 0;  ///< Bits: 1 mist, 2 flood.
};

/// "<Idle|MPos:…>" with its end, and the countdowns after it.
struct SimReport {
  std::string text;
  SimCountdowns next;
};
SimReport report_of(const SimSnapshot& machine, SimCountdowns countdowns);

}  // namespace lensforge
