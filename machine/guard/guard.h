// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge {

/// What the spindle does, as far as it could be verified.
enum class SpindleState {
  kStopped,
  kChanging,  ///< Asked to turn or to stop, not yet verified.
  kAtSpeed,   ///< Verified: several readings in a row, no fault.
  kFailed,    ///< Fault register, lost speed, or silence on the bus beyond its time-out.
};

/// One look at the spindle and the interlocks.
struct GuardReport {
  SpindleState spindle = SpindleState::kStopped;
  double rpm = 0.0;           ///< Last reading.
  bool interlocks_ok = true;  ///< Door, vacuum, coolant, e-stop: each as its map expects it.
  std::string reason;         ///< What is wrong, naming device, signal, value and rule; or empty.
};

/// What a record of the guard tells.
enum class GuardEvent {
  kCommand,    ///< Start, change of speed or stop was asked for.
  kState,      ///< The spindle's state changed.
  kSpeed,      ///< A speed, now and then while it stays and at once when it moves.
  kTrouble,    ///< A fault, a loss of speed or of the bus; empty text: it is over.
  kInterlock,  ///< An interlock changed; empty text: all are as they should be.
};

/// One entry for the job's journal, to be set against the line that runs at the time.
struct GuardRecord {
  double time = 0.0;  ///< s of the guard's clock.
  GuardEvent event = GuardEvent::kSpeed;
  double rpm = 0.0;
  std::string text;
};

/// Spindle and interlocks of a machine, watched beside the controller.
class Guard {
 public:
  virtual ~Guard() = default;
  /// Asks for `rpm`, clockwise seen from above where `clockwise`; returns at once.
  virtual void spin(double rpm, bool clockwise) = 0;
  /// Asks for a stop; returns at once.
  virtual void stop() = 0;
  /// Reads whatever is due by the poll intervals and reports the state. Never throws for
  /// what the bus or a device does: that is kFailed and a reason. Bounded in time.
  virtual GuardReport poll() = 0;
  /// Hands over what happened since the last call, oldest first.
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
