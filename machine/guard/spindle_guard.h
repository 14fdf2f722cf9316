// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "machine/guard/guard.h"
#include "machine/guard/modbus_bus.h"
#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge {

/// Polls the signals of one device, each at its interval, and reports those that can no longer be
/// read: more failures in a row than its retries, of the signal or of the whole device, or silence
/// beyond the device's limit.
class DeviceWatch {
 public:
  struct Reading {
    std::size_t signal;   ///< Number returned by add().
    std::uint16_t value;  ///< Masked.
    double time;
  };

  DeviceWatch(BusSession session, double silence_limit, Clock& clock)
      : session_(std::move(session)), silence_limit_(silence_limit), clock_(clock) {}

  /// Adds a signal. @return its number.
  std::size_t add(const ReadSignal& signal);
  /// Reads the due signals, each at most once, and stops after the first one without an answer: at
  /// most one time-out per call.
  std::vector<Reading> poll();
  /// True if write() may be called now.
  [[nodiscard]] bool ready() const { return session_.ready(); }
  /// @pre ready(). @return the error; empty on success.
  std::optional<std::string> write(const RegisterAddress& at, std::uint16_t value);
  /// The reason for which the signal's last value is unreliable; empty if it is reliable.
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
  std::optional<double> silent_since_;  ///< Time of the first of the unanswered requests.
  std::string last_error_;
  int unanswered_ = 0;  ///< Requests in a row.
};

/// Compares a spindle's readings with the requested speed. Pure logic: time and readings are
/// arguments, nothing is read or written. A failure during a request for a speed, or already
/// present when it is made, stays until the next request; while stopping or idle it lasts as long
/// as its cause.
class SpindleWatch {
 public:
  explicit SpindleWatch(const SpindleMap& map) : map_(map) {}

  void expect_speed(double rpm, bool clockwise, double now);
  void expect_stop(double now);
  /// The device has accepted the command: readings count from now on.
  void command_taken(double now);
  /// The device has not accepted the command yet.
  void command_failed(const std::string& error) { command_error_ = error; }

  void see_speed(double rpm, double now);
  void see_fault(std::uint16_t code, double now);
  void see_at_speed(bool at_speed, double now);
  void see_direction(std::uint16_t value, double now);
  /// The device cannot be read or written; empty: it works again.
  void set_bus_trouble(const std::string& reason);
  /// The request cannot be fulfilled: failed until the next request.
  void refuse(const std::string& reason);
  /// Checks the time since the request against the limits.
  void check_time(double now);

  [[nodiscard]] SpindleState state() const;
  /// The fault, without the device's name; empty if none.
  [[nodiscard]] std::string reason() const;
  [[nodiscard]] double rpm() const { return rpm_; }

 private:
  enum class Goal { kNone, kSpeed, kStop };
  /// Latest value of a signal other than the speed, and its time.
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

  std::string latched_;        ///< The first failure since a speed was requested.
  std::string bus_trouble_;    ///< Live.
  std::string fault_trouble_;  ///< Live.
  std::string speed_trouble_;  ///< Live.
};

/// The party that commands the spindle.
enum class SpindleOwner {
  kHost,        ///< The guard writes the commands of the register map.
  kController,  ///< The controller's M3; the guard only watches. Call spin() and stop() before the
                ///< controller executes the word.
};

struct GuardOptions {
  SpindleOwner owner = SpindleOwner::kHost;
  double record_interval = 1.0;  ///< s between records of a constant speed.
  double record_change = 0.01;   ///< Relative change of speed that is recorded at once.
};

/// Returns the spindle of the guarded devices. @throw InputError unless exactly one has a spindle,
/// with commands if the host drives it.
SpindleMap only_spindle(const std::vector<RegisterMap>& maps, SpindleOwner owner);

/// A device and the bus to it.
struct GuardedDevice {
  RegisterMap map;
  std::unique_ptr<RegisterBus> bus;
};

/// Watches a spindle and interlocks over Modbus, on the thread that calls it; poll() takes as long
/// as its exchanges, with at most one time-out per device (BackgroundGuard keeps this off a
/// sender's thread).
///
/// A failure never stops the spindle; only stop() does. A start that fails, or is requested during
/// a fault, is abandoned; a stop is repeated until the device accepts it. Interlocks that were not
/// read yet or cannot be read are not ok.
class SpindleGuard final : public Guard {
 public:
  /// @throw InputError as only_spindle() does.
  SpindleGuard(std::vector<GuardedDevice> devices, const GuardOptions& options, Clock& clock);

  void spin(double rpm, bool clockwise) override;
  void stop() override;
  GuardReport poll() override;
  std::vector<GuardRecord> take_records() override;

  /// True while the device has not accepted a command.
  [[nodiscard]] bool commands_pending() const { return !pending_.empty(); }

 private:
  enum class Role { kSpeed, kFault, kAtSpeed, kDirection, kInterlock };
  /// Meaning of a device's signal.
  struct Meaning {
    Role role;
    std::size_t interlock;  ///< Index in interlocks_.
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
  bool stopping_ = false;  ///< The pending command is a stop.
  int failed_writes_ = 0;
  bool commands_first_ = true;
  Running asked_ = Running::kNo;
  Running running_ = Running::kNo;  ///< Last command that the device accepted.

  std::deque<GuardRecord> records_;
  GuardReport reported_;
  std::string reported_interlock_;
  double speed_recorded_at_;
  double speed_recorded_ = 0.0;
};

/// Runs a SpindleGuard on its own thread; a sender never waits for the bus. poll() returns the
/// newest report. Failures and open interlocks that lasted only between two polls appear in at
/// least one report. A report older than the limit counts as kFailed.
class BackgroundGuard final : public Guard {
 public:
  /// @param stale_limit  seconds without a new report after which poll() returns kFailed; see
  /// stale_limit_of().
  BackgroundGuard(std::unique_ptr<SpindleGuard> guard, double stale_limit);
  /// Tries to deliver a pending command, for at most the stale limit.
  ~BackgroundGuard() override;
  BackgroundGuard(const BackgroundGuard&) = delete;
  BackgroundGuard& operator=(const BackgroundGuard&) = delete;

  void spin(double rpm, bool clockwise) override;
  void stop() override;
  GuardReport poll() override;
  std::vector<GuardRecord> take_records() override;

 private:
  using Command = std::function<void(SpindleGuard&)>;

  void run();
  void ask(Command command);
  void publish(const GuardReport& report, bool obeyed);

  std::unique_ptr<SpindleGuard> guard_;  ///< Used by the thread only.
  double stale_limit_;
  std::mutex mutex_;  ///< Guards the members below.
  std::condition_variable wake_;
  Command command_;
  bool answered_ = true;  ///< newest_ was made after the last command.
  bool ends_ = false;
  GuardReport newest_;
  double published_at_;
  std::string failure_unseen_;    ///< From a report that no poll() returned.
  std::string interlock_unseen_;  ///< From a report that no poll() returned.
  std::vector<GuardRecord> records_;
  std::thread thread_;
};

/// Returns the age in seconds at which a report counts as stale: the longest silence allowed to any
/// device, plus one connection and one exchange time-out per device.
double stale_limit_of(const std::vector<RegisterMap>& maps);

/// Creates a guard of real devices, one per map, over ModbusBus and on its own thread; it connects
/// in the background.
/// @param clock  a steady clock; must outlive the guard. @throw InputError as SpindleGuard does.
std::unique_ptr<BackgroundGuard> guard_devices(const std::vector<RegisterMap>& maps,
                                               const GuardOptions& options, Clock& clock);

}  // namespace lensforge
