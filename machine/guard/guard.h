// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// Verified state of the spindle.
enum class SpindleState {
  kStopped,
  kChanging,  ///< Commanded to turn or to stop, not yet verified.
  kAtSpeed,   ///< Verified: several readings in a row, no fault.
  kFailed,    ///< Fault register, lost speed, or silence on the bus beyond its time-out.
};

/// State of the spindle and the interlocks.
struct GuardReport {
  SpindleState spindle = SpindleState::kStopped;
  double rpm = 0.0;           ///< Last reading.
  bool interlocks_ok = true;  ///< Door, vacuum, coolant, e-stop are as the map expects.
  std::string reason;         ///< The fault: device, signal, value and rule; empty if none.
};

/// Kind of a guard record.
enum class GuardEvent {
  kCommand,    ///< Start, change of speed or stop was requested.
  kState,      ///< The spindle's state changed.
  kSpeed,      ///< A speed: at intervals while constant, at once when it changes.
  kTrouble,    ///< A fault, a loss of speed or of the bus; empty text: it has ended.
  kInterlock,  ///< An interlock changed; empty text: all are ok.
};

/// One entry for the job's journal, to be matched with the line that runs at that time.
struct GuardRecord {
  double time = 0.0;  ///< On the guard's clock, s.
  GuardEvent event = GuardEvent::kSpeed;
  double rpm = 0.0;
  std::string text;
};

/// Monitors the spindle and interlocks of a machine, independently of the controller.
class Guard {
 public:
  virtual ~Guard() = default;
  /// Requests `rpm`, clockwise seen from above if `clockwise`; returns at once.
  virtual void spin(double rpm, bool clockwise) = 0;
  /// Requests a stop; returns at once.
  virtual void stop() = 0;
  /// Reads the signals that are due and reports the state. Faults of the bus or a device are not
  /// thrown but reported as kFailed with a reason. Bounded in time.
  virtual GuardReport poll() = 0;
  /// Takes the records since the last call, oldest first.
  virtual std::vector<GuardRecord> take_records() { return {}; }
};

/// "stopped", "changing", "at speed" or "failed".
constexpr const char* spindle_state_name(SpindleState state) {
  switch (state) {
    case SpindleState::kStopped:
      return "stopped";
    case SpindleState::kChanging:
      return "changing";
    case SpindleState::kAtSpeed:
      return "at speed";
    case SpindleState::kFailed:
      break;
  }
  return "failed";
}

}  // namespace lensforge
