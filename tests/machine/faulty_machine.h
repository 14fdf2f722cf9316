// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "machine/sim/simulated_machine.h"

namespace lensforge {

/// Kinds of fault.
enum class FaultKind {
  kUnplug,        ///< The link is down for `seconds`; the controller keeps running.
  kUnplugReset,   ///< The link and the controller's power are off for `seconds`.
  kReset,         ///< The controller restarts and sends its banner (brown-out).
  kAlarm,         ///< Alarm `code`; 0 stands for 1, a limit switch.
  kError,         ///< The next G-code line is answered with error `code` (0: 20), not run.
  kLostReply,     ///< The next ok or error is lost.
  kGarbledReply,  ///< The next ok or error arrives with a wrong byte.
  kDuplicatedOk,  ///< The next ok arrives twice.
  kStall,         ///< The controller sends nothing for `seconds`.
  kRxOverrun,     ///< `code` (0: 8) bytes find the receive buffer full.
  kPartialWrite,  ///< The link takes part of a write, then nothing for `seconds`.
  kDoor,          ///< The door opens, and closes after `seconds`.
  kHold,          ///< Feed hold is pressed at the machine.
  kDroppedByte,   ///< One byte vanishes.
};

/// A fault that occurs once: at the byte after the stated number of bytes in `direction` since
/// power-up.
struct SimulatedFault {
  FaultKind kind = FaultKind::kStall;
  WireDirection direction = WireDirection::kToController;
  std::int64_t at_byte = 0;
  double seconds = 1.0;
  int code = 0;
};

/// A simulated machine to which faults happen.
class FaultyMachine : public SimulatedMachine {
 public:
  using SimulatedMachine::SimulatedMachine;

  /// Adds a pending fault.
  void add_fault(const SimulatedFault& fault) { faults_.push_back(fault); }
  /// A fault that occurred, and its time.
  struct Strike {
    SimulatedFault fault;
    double time = 0.0;
  };
  [[nodiscard]] const std::vector<Strike>& strikes() const { return strikes_; }

 private:
  bool opening() override;
  [[nodiscard]] bool blocked() const override { return now() < blocked_until_; }
  std::size_t taken(std::size_t count) override;
  Passage to_controller() override;
  bool to_host(std::string& text) override;
  [[nodiscard]] double spoken_at(double time) const override;
  [[nodiscard]] double next_event() const override;
  void passed() override;

  SimulatedFault take_fault(std::size_t index);
  bool strike(std::size_t index, std::string& text, std::size_t at);
  void strike_machine(const SimulatedFault& fault);
  void unplug(const SimulatedFault& fault);
  void spoil_reply(std::string& text);

  std::vector<SimulatedFault> faults_;
  std::vector<Strike> strikes_;
  std::int64_t accepted_ = 0;  ///< Bytes that the link has taken.
  double unplugged_until_ = -1.0;
  bool powerless_ = false;
  double silent_until_ = -1.0;
  double blocked_until_ = -1.0;
  double door_until_ = -1.0;
  bool lose_reply_ = false;
  bool garble_reply_ = false;
  bool double_ok_ = false;
};

}  // namespace lensforge
