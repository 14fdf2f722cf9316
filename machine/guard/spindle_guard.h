// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/guard.h"
#include "machine/guard/modbus_bus.h"
#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge {

/// Polls the signals of one device, each at its interval, and tells which of them cannot be read
/// any more: more failures in a row than its retries, its own or the whole device's, or silence
/// beyond the device's limit.
class DeviceWatch {
 public:
  struct Reading {
    std::size_t signal;   ///< As counted by add().
    std::uint16_t value;  ///< Masked.
    double time;
  };

  DeviceWatch(BusSession session, double silence_limit, Clock& clock)
      : session_(std::move(session)), silence_limit_(silence_limit), clock_(clock) {}

  /// Takes a signal up. @return its number.
  std::size_t add(const ReadSignal& signal);
  /// Reads what is due, each signal at most once, and none more after one that was not answered:
  /// at most one time-out a call.
  std::vector<Reading> poll();
  /// Whether write() may be called now.
  [[nodiscard]] bool ready() const { return session_.ready(); }
  /// @pre ready(). @return what went wrong, or nothing.
  std::optional<std::string> write(const RegisterAddress& at, std::uint16_t value);
  /// Why the signal's last value is not to be relied on; or empty.
  [[nodiscard]] std::string trouble(std::size_t signal) const;

 private:
  struct Polled {
    ReadSignal signal;
    double due;
    int failures = 0;
    std::string error;
  };

  bool read_one(std::size_t index, std::vector<Reading>& readings);

  BusSession session_;
  double silence_limit_;
  Clock& clock_;
  std::vector<Polled> polled_;
  std::optional<double> silent_since_;  ///< The first request since which none was answered.
  std::string last_error_;
  int unanswered_ = 0;  ///< Requests in a row.
};

/// Judges readings of a spindle against what was asked of it. Pure logic: time and readings come in
/// through the calls, nothing is read or written. A failure while a speed is asked for, or one that
/// stands when it is asked for, stays until the next request; while stopping or idle it lasts as
/// long as its cause.
class SpindleWatch {
 public:
  explicit SpindleWatch(const SpindleMap& map) : map_(map) {}

  void expect_speed(double rpm, bool clockwise, double now);
  void expect_stop(double now);
  /// The device has taken the command: readings from now on count.
  void command_taken(double now);
  /// The device has not taken it yet.
  void command_failed(const std::string& error) { command_error_ = error; }

  void see_speed(double rpm, double now);
  void see_fault(std::uint16_t code, double now);
  void see_at_speed(bool at_speed, double now);
  void see_direction(std::uint16_t value, double now);
  /// The device cannot be read or written; empty: it can again.
  void set_bus_trouble(const std::string& reason);
  /// A request that cannot be fulfilled: stays failed until the next.
  void refuse(const std::string& reason);
  /// Judges the time since the request.
  void check_time(double now);

  [[nodiscard]] SpindleState state() const;
  /// What is wrong, without the device's name; or empty.
  [[nodiscard]] std::string reason() const;
  [[nodiscard]] double rpm() const { return rpm_; }

 private:
  enum class Goal { kNone, kSpeed, kStop };
  /// A signal beside the speed: what it last said, and when.
  struct Flag {
    bool good = false;
    double seen = 0.0;
    int bad = 0;
  };

  void ask(Goal goal, double now);
  void fail(std::string& live, const std::string& reason);
  void judge(double now);
  [[nodiscard]] bool speed_is_good() const;
  [[nodiscard]] bool flags_are_good() const;
  [[nodiscard]] std::string speed_text() const;
  [[nodiscard]] std::string direction_text() const;
  [[nodiscard]] std::string unverified_text() const;
  void note_flag(Flag& flag, bool good, double now, const std::string& trouble);

  SpindleMap map_;
  Goal goal_ = Goal::kNone;
  double asked_rpm_ = 0.0;
  bool clockwise_ = true;
  double asked_at_ = 0.0;
  bool taken_ = true;
  std::string command_error_;
  bool verified_ = false;

  double rpm_ = 0.0;
  int good_reads_ = 0;
  int bad_reads_ = 0;
  double streak_start_ = 0.0;
  Flag fault_;
  Flag at_speed_;
  Flag direction_;

  std::string latched_;        ///< The first failure since a speed was asked for.
  std::string bus_trouble_;    ///< Live.
  std::string fault_trouble_;  ///< Live.
  std::string speed_trouble_;  ///< Live.
};

/// Who tells the spindle to turn.
enum class SpindleOwner {
  kHost,        ///< The guard writes the commands of the register map.
  kController,  ///< The controller's M3 does; the guard only watches. Tell it by spin() and stop()
                ///< what to expect, before the controller executes the word.
};

struct GuardOptions {
  SpindleOwner owner = SpindleOwner::kHost;
  double record_interval = 1.0;  ///< s between records of a speed that stays.
  double record_change = 0.01;   ///< Share by which a speed has to move to be recorded at once.
};

/// The spindle of the devices that are to be guarded. @throw InputError unless exactly one has a
/// spindle, with commands where the host is to drive it.
SpindleMap only_spindle(const std::vector<RegisterMap>& maps, SpindleOwner owner);

/// A device and the bus to it.
struct GuardedDevice {
  RegisterMap map;
  std::unique_ptr<RegisterBus> bus;
};

/// Watches a spindle and interlocks over Modbus, on the thread that calls it; a poll() lasts as
/// long as its exchanges, of which at most one a device runs into a time-out (BackgroundGuard
/// keeps that off a sender's thread).
///
/// A failure never stops the spindle: only stop() does. A start that fails, or is asked for while
/// something is wrong, is given up for good; a stop is tried until it is taken. Interlocks that
/// were not read yet, or cannot be read, are not ok.
class SpindleGuard final : public Guard {
 public:
  /// @throw InputError as only_spindle() does.
  SpindleGuard(std::vector<GuardedDevice> devices, const GuardOptions& options, Clock& clock);

  void spin(double rpm, bool clockwise) override;
  void stop() override;
  GuardReport poll() override;
  std::vector<GuardRecord> take_records() override;

  /// Whether a command has not been taken yet.
  [[nodiscard]] bool commands_pending() const { return !pending_.empty(); }

 private:
  enum class Role { kSpeed, kFault, kAtSpeed, kDirection, kInterlock };
  /// What a device's signal means.
  struct Meaning {
    Role role;
    std::size_t interlock;  ///< Of interlocks_.
  };
  struct Device {
    std::string name;
    DeviceWatch watch;
    std::vector<Meaning> meanings;
  };
  struct WatchedInterlock {
    std::size_t device;
    std::size_t signal;
    std::uint16_t expected;
    bool was_read;
    std::uint16_t value;
  };
  enum class Running { kNo, kClockwise, kCounterClockwise };

  void add_device(GuardedDevice device);
  void add_spindle(Device& device, const SpindleMap& map);
  void add_interlocks(Device& device, const std::vector<Interlock>& interlocks);
  [[nodiscard]] const SpindleMap& spindle() const { return spindle_map_; }
  [[nodiscard]] std::string refusal(double rpm, bool clockwise) const;
  [[nodiscard]] std::deque<WriteStep> start_steps(double rpm, bool clockwise) const;
  void give_up_failed_start();
  void exchange();
  void read_signals();
  void send_commands();
  void command_failed(const std::string& error);
  void apply(Device& device, const DeviceWatch::Reading& reading);
  [[nodiscard]] std::string spindle_bus_trouble() const;
  [[nodiscard]] std::string interlock_trouble() const;
  [[nodiscard]] std::string interlock_trouble(const WatchedInterlock& interlock,
                                              const std::string& name) const;
  void record(GuardEvent event, const std::string& text);
  void record_changes(const GuardReport& report, const std::string& interlock_trouble);

  GuardOptions options_;
  Clock& clock_;
  SpindleMap spindle_map_;
  std::size_t spindle_device_ = 0;
  std::vector<Device> devices_;
  std::vector<WatchedInterlock> interlocks_;
  SpindleWatch watch_;
  std::vector<std::string> interlock_names_;

  std::deque<WriteStep> pending_;
  bool stopping_ = false;  ///< What is pending is a stop.
  int failed_writes_ = 0;
  bool commands_first_ = true;
  Running asked_ = Running::kNo;
  Running running_ = Running::kNo;  ///< What the device last took.

  std::deque<GuardRecord> records_;
  GuardReport reported_;
  std::string reported_interlock_;
  double speed_recorded_at_;
  double speed_recorded_ = 0.0;
};

}  // namespace lensforge
