// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Formats a number with `decimals` decimals, independent of the locale.
std::string fixed_text(double value, int decimals);

/// A word followed by an integer.
std::string numbered(const std::string& word, std::int64_t number);

/// Three numbers separated by commas.
std::string fixed_text(const Eigen::Vector3d& value, int decimals);

/// Firmware to simulate.
enum class SimulatedFirmware { kGrbl, kGrblHal };

/// Build and settings of the simulated controller.
struct SimulatedOptions {
  SimulatedFirmware firmware = SimulatedFirmware::kGrbl;
  std::size_t rx_bytes = 128;
  int planner_blocks = 15;
  double line_seconds = 0.0025;    ///< Time to read one line: 400 lines/s, as on an 8-bit board.
  double eeprom_seconds = 0.02;    ///< Time of a settings write, during which bytes are lost.
  bool line_numbers = false;       ///< Built with line numbers: `Ln:` in reports.
  bool mist = false;               ///< Built with M7.
  bool instant = false;            ///< Motions, dwells and lines take no time.
  std::map<int, double> settings;  ///< `$` values that differ from the firmware's defaults.
  Eigen::Vector3d stands_at = Eigen::Vector3d::Zero();  ///< Machine position at power-up.
};

/// Grbl 1.1 on an 8-bit board with a homing mill of 400 × 300 × 100 mm; soft limits on, spindle
/// of 24,000 rpm, line numbers built in.
SimulatedOptions simulated_grbl();

/// The same mill under grblHAL on a 32-bit board.
SimulatedOptions simulated_grblhal();

/// A straight piece of motion that the machine ran: mm, true machine coordinates. They differ from
/// the reported ones once steps were lost.
struct ExecutedPiece {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  double feed = 0.0;  ///< As programmed, mm/min; 0 for a rapid.
  bool rapid = false;
  bool jog = false;
  bool complete = true;       ///< Ran to its planned end.
  std::int64_t number = 0;    ///< N word of its line; 0 without one.
  std::int64_t received = 0;  ///< Number of its line since power-up, from 1.
  int spindle = 0;            ///< +1 clockwise, −1 counter-clockwise, 0 off, when it began.
  double rpm = 0.0;
  double begin_time = 0.0;  ///< s
  double end_time = 0.0;
};

/// Another event of the machine.
struct MachineEvent {
  double time = 0.0;
  std::string what;  ///< "reset", "alarm 3", "error 20", "hold", "resume", "door", "homed",
                     ///< "overrun", "spindle 1 23000", "tool 2", "end", "power up"
};

/// Observer of the machine. Called as things happen, without storing them; programs may have any
/// length.
struct MachineWatch {
  std::function<void(const ExecutedPiece&)> piece;   ///< A piece ended.
  std::function<void(const ExecutedPiece&)> begins;  ///< A piece begins; `end` is its target.
  std::function<void(const MachineEvent&)> event;
};

/// `$` values and start-up lines of a simulated controller.
class SimSettings {
 public:
  explicit SimSettings(const SimulatedOptions& options);

  /// A value; 0 if the firmware lacks that number.
  [[nodiscard]] double operator[](int number) const;
  [[nodiscard]] bool on(int number) const { return (*this)[number] != 0.0; }
  /// Three values from `first` on: X, Y, Z.
  [[nodiscard]] Eigen::Vector3d axes(int first) const;
  /// Writes a value. @return 0 or an error number.
  int set(int number, double value);
  /// Restores the values of the options (`$RST=$`).
  void restore() { values_ = defaults_; }
  /// The answer to `$$`, without its ok.
  [[nodiscard]] std::string text() const;

  std::array<std::string, 2> startup;  ///< `$N0`, `$N1`

 private:
  std::map<int, double> values_;
  std::map<int, double> defaults_;
};

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
