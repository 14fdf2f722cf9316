// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "machine/link/link.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {

/// Direction of a byte between host and controller.
enum class WireDirection { kToController, kToHost };

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

/// Connection between host and controller.
struct WireOptions {
  double bytes_per_second = 11520.0;  ///< Each way; 0 for no limit.
  double latency = 0.001;             ///< s, each way.
  double gathering = 0.001;           ///< s for which arriving bytes are collected into one read.
  std::size_t host_buffer = 4096;     ///< Maximum number of written bytes in transit.
  bool reset_on_open = false;         ///< Opening the port restarts the board, as many do.
};

/// A simulated controller with its connection, faults and clock. Time passes only during waits and
/// reads (a read takes at least 10 µs).
class SimulatedMachine : public Clock {
 public:
  explicit SimulatedMachine(const SimulatedOptions& options, const WireOptions& wire = {},
                            const MachineWatch& watch = {});

  [[nodiscard]] double now() const override { return controller_.now(); }
  void wait(double seconds) override { run_until(now() + seconds); }

  /// Opens the port and closes any earlier link. @throw LinkLost while it is unplugged.
  std::unique_ptr<Link> open();

  /// Adds a pending fault.
  void add_fault(const SimulatedFault& fault) { faults_.push_back(fault); }
  /// A fault that occurred, and its time.
  struct Strike {
    SimulatedFault fault;
    double time = 0.0;
  };
  [[nodiscard]] const std::vector<Strike>& strikes() const { return strikes_; }
  /// Number of bytes in that direction since power-up.
  [[nodiscard]] std::int64_t bytes(WireDirection direction) const {
    return carried_[static_cast<std::size_t>(direction)];
  }

  [[nodiscard]] SimulatedController& controller() { return controller_; }

 private:
  friend class SimulatedLink;
  struct Chunk {
    double begin = 0.0;  ///< Arrival time of its first byte.
    std::string text;
    std::size_t taken = 0;
  };

  std::string read(std::int64_t opened, double wait);
  std::size_t write(std::int64_t opened, std::string_view bytes);
  void require_open(std::int64_t opened) const;
  void run_until(double time);
  void run_to_first_byte(double deadline);
  void run_to_next_event(double time);
  void deliver();
  void hear();
  void carry_to_host(const Spoken& spoken);
  bool strike(std::size_t index, std::string* text, std::size_t at);
  void strike_machine(const SimulatedFault& fault);
  void unplug(const SimulatedFault& fault);
  void spoil_replies(std::string& text);
  void end_timed_faults();
  [[nodiscard]] double first_arrival() const;
  [[nodiscard]] double byte_seconds() const;
  std::string take_arrived();

  WireOptions wire_;
  SimulatedController controller_;
  std::int64_t opened_ = 0;  ///< Number of the open link; 0 for none.
  std::int64_t opens_ = 0;
  double unplugged_until_ = -1.0;
  bool powerless_ = false;
  std::string outgoing_;
  std::size_t outgoing_read_ = 0;
  double next_byte_ = 0.0;  ///< Arrival time of the next outgoing byte.
  std::deque<Chunk> incoming_;
  double line_free_ = 0.0;  ///< Time at which the line to the host is free.
  std::array<std::int64_t, 2> carried_{};
  std::int64_t accepted_ = 0;
  std::vector<SimulatedFault> faults_;
  std::vector<Strike> strikes_;
  double silent_until_ = -1.0;
  double blocked_until_ = -1.0;
  double door_until_ = -1.0;
  bool lose_reply_ = false;
  bool garble_reply_ = false;
  bool double_ok_ = false;
};

/// The port of a SimulatedMachine; lost for good once the machine is unplugged or opened again.
class SimulatedLink : public Link {
 public:
  SimulatedLink(SimulatedMachine& machine, std::int64_t opened)
      : machine_(machine), opened_(opened) {}
  std::string read(double wait) override { return machine_.read(opened_, wait); }
  std::size_t write(std::string_view bytes) override { return machine_.write(opened_, bytes); }

 private:
  SimulatedMachine& machine_;
  std::int64_t opened_;
};

}  // namespace lensforge
