// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "machine/guard/device_watch.h"
#include "machine/guard/guard.h"
#include "machine/guard/register_map.h"
#include "machine/guard/spindle_watch.h"

namespace lensforge {

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
