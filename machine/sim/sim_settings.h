// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

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

}  // namespace lensforge
