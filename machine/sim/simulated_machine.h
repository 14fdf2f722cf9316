// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include "machine/link/link.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {

/// Direction of a byte between host and controller.
enum class WireDirection { kToController, kToHost };

/// Connection between host and controller.
struct WireOptions {
  double bytes_per_second = 11520.0;  ///< Each way; 0 for no limit.
  double latency = 0.001;             ///< s, each way.
  double gathering = 0.001;           ///< s for which arriving bytes are collected into one read.
  std::size_t host_buffer = 4096;     ///< Maximum number of written bytes in transit.
  bool reset_on_open = false;         ///< Opening the port restarts the board, as many do.
  /// Simulated seconds per second; 0: as fast as the machine computes.
  double pace = 0.0;
};

/// A simulated controller with its connection and clock. Time passes only during waits and
/// reads (a read takes at least 10 µs).
class SimulatedMachine : public Clock {
 public:
  explicit SimulatedMachine(const SimulatedOptions& options, const WireOptions& wire = {},
                            const MachineWatch& watch = {});

  [[nodiscard]] double now() const override { return controller_.now(); }
  void wait(double seconds) override;

  /// Opens the port and closes any earlier link. @throw LinkLost while it is unplugged.
  std::unique_ptr<Link> open();

  /// Number of bytes in that direction since power-up.
  [[nodiscard]] std::int64_t bytes(WireDirection direction) const {
    return carried_[static_cast<std::size_t>(direction)];
  }

  [[nodiscard]] SimulatedController& controller() { return controller_; }

 protected:
  // Places at which tests disturb the connection. None does by default.

  /// Fate of a byte on its way to the controller.
  enum class Passage {
    kArrives,
    kLost,
    kCut,  ///< The link was closed instead.
  };

  /// The port is opened. @return true if the board's power was off. @throw LinkLost
  virtual bool opening() { return false; }
  /// True if the link takes nothing at present.
  [[nodiscard]] virtual bool blocked() const { return false; }
  /// Number of bytes that the link takes of `count`.
  virtual std::size_t taken(std::size_t count) { return count; }
  virtual Passage to_controller() { return Passage::kArrives; }
  /// @return false if the link was closed instead.
  virtual bool to_host(std::string& /*text*/) { return true; }
  /// Time at which a text of the controller begins on the line, from when it was said.
  [[nodiscard]] virtual double spoken_at(double time) const { return time; }
  /// Time of the next disturbance that depends on time alone.
  [[nodiscard]] virtual double next_event() const {
    return std::numeric_limits<double>::infinity();
  }
  /// Time has passed.
  virtual void passed() {}

  /// Closes the link; bytes in transit are lost.
  void close();

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
  /// Sleeps until the time has come to which the simulation has run, at WireOptions::pace.
  void keep_pace() const;
  void run_to_first_byte(double deadline);
  void run_to_next_event(double time);
  void deliver();
  void hear();
  void carry_to_host(const Spoken& spoken);
  [[nodiscard]] double first_arrival() const;
  [[nodiscard]] double byte_seconds() const;
  std::string take_arrived();

  WireOptions wire_;
  SimulatedController controller_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::int64_t opened_ = 0;  ///< Number of the open link; 0 for none.
  std::int64_t opens_ = 0;
  std::string outgoing_;
  std::size_t outgoing_read_ = 0;
  double next_byte_ = 0.0;  ///< Arrival time of the next outgoing byte.
  std::deque<Chunk> incoming_;
  double line_free_ = 0.0;  ///< Time at which the line to the host is free.
  std::array<std::int64_t, 2> carried_{};
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
