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

/// Way of a byte between host and controller.
enum class WireDirection { kToController, kToHost };

/// What can go wrong.
enum class FaultKind {
  kUnplug,        ///< The link is gone for `seconds`; the controller goes on.
  kUnplugReset,   ///< Likewise, and the controller is without power meanwhile.
  kReset,         ///< The controller starts anew by itself and greets (brown-out).
  kAlarm,         ///< Alarm `code`; 0 stands for 1, a limit switch.
  kError,         ///< The next G-code line is answered by error `code` (0: 20) and not run.
  kLostReply,     ///< The next ok or error is lost on its way.
  kGarbledReply,  ///< The next ok or error arrives with a wrong byte.
  kDuplicatedOk,  ///< The next ok arrives twice.
  kStall,         ///< Nothing is heard of the controller for `seconds`.
  kRxOverrun,     ///< `code` (0: 8) bytes find the receive buffer full.
  kPartialWrite,  ///< The link takes part of a write, then nothing for `seconds`.
  kDoor,          ///< The door opens, and closes after `seconds`.
  kHold,          ///< Somebody presses feed hold at the machine.
  kDroppedByte,   ///< One byte vanishes.
};

/// One fault, once: it strikes when so many bytes have gone `direction`'s way since power-up, at
/// the byte after them.
struct SimulatedFault {
  FaultKind kind = FaultKind::kStall;
  WireDirection direction = WireDirection::kToController;
  std::int64_t at_byte = 0;
  double seconds = 1.0;
  int code = 0;
};

/// The line between host and controller.
struct WireOptions {
  double bytes_per_second = 11520.0;  ///< Each way; 0 for no limit.
  double latency = 0.001;             ///< s, each way.
  double gathering = 0.001;           ///< s that arriving bytes are gathered for one read.
  std::size_t host_buffer = 4096;     ///< Bytes that a write may leave on their way.
  bool reset_on_open = false;         ///< Opening the port restarts the board, as many do.
};

/// A simulated controller at the end of a line, with faults, and the clock that all of it runs by:
/// time passes only while somebody waits or reads (a read takes 10 µs at least).
class SimulatedMachine : public Clock {
 public:
  explicit SimulatedMachine(const SimulatedOptions& options, const WireOptions& wire = {},
                            const MachineWatch& watch = {});

  [[nodiscard]] double now() const override { return controller_.now(); }
  void wait(double seconds) override { run_until(now() + seconds); }

  /// Opens the port, closing what was open. @throw LinkLost while it is unplugged.
  std::unique_ptr<Link> open();

  /// Adds a fault to those that wait for their byte.
  void add_fault(const SimulatedFault& fault) { faults_.push_back(fault); }
  /// Faults that have struck, in order, and when.
  struct Strike {
    SimulatedFault fault;
    double time = 0.0;
  };
  [[nodiscard]] const std::vector<Strike>& strikes() const { return strikes_; }
  /// Bytes that have gone that way since power-up.
  [[nodiscard]] std::int64_t bytes(WireDirection direction) const {
    return carried_[static_cast<std::size_t>(direction)];
  }

  [[nodiscard]] SimulatedController& controller() { return controller_; }

 private:
  friend class SimulatedLink;
  struct Chunk {
    double begin = 0.0;  ///< When its first byte starts to arrive.
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
  std::int64_t opened_ = 0;  ///< Ordinal of the link that is open; 0 for none.
  std::int64_t opens_ = 0;
  double unplugged_until_ = -1.0;
  bool powerless_ = false;
  std::string outgoing_;
  std::size_t outgoing_read_ = 0;
  double next_byte_ = 0.0;  ///< When the next outgoing byte arrives.
  std::deque<Chunk> incoming_;
  double line_free_ = 0.0;  ///< When the line to the host is free for the next chunk.
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

/// The port of a SimulatedMachine; lost for good once the machine was unplugged or opened anew.
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
