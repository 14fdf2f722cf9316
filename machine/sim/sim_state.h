// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Received, unread bytes.
struct SimBuffer {
  std::string bytes;
  std::size_t read = 0;  ///< Number of bytes already read.

  [[nodiscard]] bool empty() const { return read == bytes.size(); }
  [[nodiscard]] std::size_t size() const { return bytes.size() - read; }
  [[nodiscard]] std::string_view rest() const { return std::string_view(bytes).substr(read); }
  /// Appends a byte.
  void add(char byte);
};

/// The line being received, without dropped characters.
struct SimIntake {
  std::string line;
  bool overflows = false;
  char comment = 0;   ///< '(' or ';' while in one.
  char last_end = 0;  ///< CR or LF, if that was the last character.
};

/// A firmware's rules for reading lines.
struct SimIntakeRules {
  std::size_t longest = 79;  ///< Maximum number of characters.
  bool crlf_is_one = false;  ///< grblHAL: CR LF is one line end; Grbl: two.
};

/// Result of taken(). `ended`: the character ends the line.
struct SimTaken {
  SimIntake intake;
  bool ended = false;
};
SimTaken taken(SimIntake intake, char c, const SimIntakeRules& rules);

/// States, named as in reports.
enum class MachineState { kIdle, kRun, kHold, kJog, kAlarm, kDoor, kCheck, kHome, kSleep, kTool };

/// The firmware's view of the machine. Times in s of the simulation.
struct SimState {
  static constexpr double kNever = -1.0;

  MachineState state = MachineState::kIdle;
  int alarm = 0;           ///< Last one, for grblHAL's reports.
  bool critical = false;   ///< Only a reset is accepted.
  bool stopped = true;     ///< The motion has stopped after a hold or a door.
  bool door_open = false;  ///< State of the switch.
  bool limit_hit = false;  ///< A line exceeded the travel: stop, then alarm 2.
  bool homed = false;
  bool tool_acknowledged = false;   ///< Other lines run beside the tool change.
  double restoring_until = kNever;  ///< Spindle after a door.
  double homing_until = kNever;
  int door_spindle = 0;  ///< Restored after a door.
  double door_rpm = 0.0;
};

/// State of the motion queue.
struct SimMotion {
  bool empty = true;
  bool holding = false;
  bool stands = true;  ///< At speed 0.

  [[nodiscard]] bool at_stand() const { return empty || (holding && stands); }
};

/// The firmware's decisions and state changes as pure functions. The controller applies them to
/// queue, spindle and output.
namespace sim_state {

/// True if the mill moves.
bool moving(const SimState& now, const SimMotion& motion);
/// True if no line is accepted.
bool suspended(const SimState& now);
/// True if nothing moves or is held; most `$` lines are then accepted.
bool still(const SimState& now, const SimMotion& motion);
bool takes_jog(const SimState& now, const SimMotion& motion);

/// Next event to handle.
enum class Due {
  kNothing,
  kHomed,
  kRestored,  ///< The spindle turns again after a door.
  kStopped,   ///< The motion has stopped after a hold, a door or a cancelled jog.
  kRanOut,    ///< Nothing is left to run.
  kLimit,     ///< The motion before a line that exceeds the travel has ended.
};
Due due(const SimState& now, const SimMotion& motion, double time);

/// Effect of a cycle start.
enum class Start { kNothing, kLeaveTool, kBegin, kRestoreSpindle, kResume };
Start on_cycle_start(const SimState& now);

/// Effect of a feed hold.
enum class Hold { kNothing, kCancelJog, kStop };
Hold on_feed_hold(const SimState& now);

/// Effect of an opened door.
enum class Door { kNothing, kAlarm, kStop };
Door on_door(const SimState& now);

/// The alarm caused by a soft reset, or 0.
int alarm_of_reset(const SimState& now);

/// Decelerates to a stop; `shown` is the state from now on.
SimState stopping(SimState now, MachineState shown, bool moves);
/// Decelerates a cancelled jog.
SimState cancelling(SimState now);
/// Continues with the queue.
SimState resumed(SimState now, const SimMotion& motion);
/// The queue has ended.
SimState ran_out(SimState now);
/// Everything was stopped at once by alarm `code`.
SimState alarmed(SimState now, int code);
SimState homed(SimState now);
/// After any reset: alarms stay, also through sleep.
SimState restarted(SimState now);

/// "Run", "Hold:0". @param hal  as grblHAL writes it.
std::string text(const SimState& now, bool hal, double time);

}  // namespace sim_state

/// Overrides, percent of the programmed values.
struct SimOverrides {
  double feed = 100.0;
  double rapid = 100.0;
  double spindle = 100.0;
};

/// The overrides after a realtime byte; empty if it is no override.
std::optional<SimOverrides> overridden(SimOverrides before, unsigned char byte);

/// Reports until the next WCO and the next Ov.
struct SimCountdowns {
  int offset = 0;
  int overrides = 1;
};

/// Data of a status report. Lengths in mm, times in s.
struct SimSnapshot {
  std::string state;
  bool rests = true;  ///< Idle or in alarm: some fields are sent more often.
  int mask = 0;       ///< $10
  bool inches = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Machine position.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();    ///< Machine − work.
  int free_blocks = 0;
  std::size_t free_bytes = 0;
  std::int64_t number = 0;  ///< N word of the running motion; 0 for none.
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
