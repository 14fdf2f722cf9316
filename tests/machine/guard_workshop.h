// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "machine/guard/spindle_guard.h"
#include "machine/guard_clock.h"
#include "machine/simulated_spindle.h"

namespace lensforge::testing {

/// Hears what is written, and can keep an address from answering.
class WiretapBus final : public RegisterBus {
 public:
  WiretapBus(std::unique_ptr<RegisterBus> bus, std::vector<std::uint16_t>& writes,
             const int& mute_address)
      : bus_(std::move(bus)), writes_(writes), mute_address_(mute_address) {}
  void open() override { bus_->open(); }
  void close() override { bus_->close(); }
  [[nodiscard]] bool is_open() const override { return bus_->is_open(); }
  void discard() override { bus_->discard(); }
  std::uint16_t read(const RegisterAddress& at) override {
    if (at.address == mute_address_) throw BusError(BusFault::kSilent, "no answer in time");
    return bus_->read(at);
  }
  void write(const RegisterAddress& at, std::uint16_t value) override {
    writes_.push_back(value);
    bus_->write(at, value);
  }

 private:
  std::unique_ptr<RegisterBus> bus_;
  std::vector<std::uint16_t>& writes_;
  const int& mute_address_;
};

constexpr double kRamp = 8000.0;  // rpm/s
constexpr double kStep = 0.01;    // s between two polls

inline std::vector<GuardedDevice> one_device(RegisterMap map, std::unique_ptr<RegisterBus> bus) {
  std::vector<GuardedDevice> devices;
  devices.push_back({std::move(map), std::move(bus)});
  return devices;
}

/// A guard over a simulated spindle, in virtual time that starts at 1000 s.
struct Workshop {
  explicit Workshop(const std::string& name, SpindleOwner owner = SpindleOwner::kHost)
      : Workshop(shipped_map(name), shipped_map(name), owner) {}
  Workshop(const RegisterMap& device, const RegisterMap& map, SpindleOwner owner)
      : spindle(device, clock, kRamp), guard(one_device(map, wiretap()), {owner}, clock) {}

  /// Polls for `seconds`; @return the last report.
  GuardReport run(double seconds) {
    GuardReport report;
    for (const double end = clock.now() + seconds; clock.now() < end; clock.wait(kStep)) {
      report = guard.poll();
      at_speed_while_still |= report.spindle == SpindleState::kAtSpeed && spindle.rpm() == 0.0;
      only_failed &= report.spindle == SpindleState::kFailed;
    }
    return report;
  }
  /// Polls until the spindle is in `state`; @return how long that took, or `limit`.
  double time_to(SpindleState state, double limit = 100.0) {
    const double start = clock.now();
    while (clock.now() - start < limit && guard.poll().spindle != state) clock.wait(kStep);
    return clock.now() - start;
  }
  void reach(double rpm) {
    guard.spin(rpm, true);
    ASSERT_LT(time_to(SpindleState::kAtSpeed), 100.0) << guard.poll().reason;
  }
  void trouble(SpindleTrouble trouble, double duration = 1e9, double value = 0.0,
               const std::string& name = {}) {
    spindle.add({trouble, clock.now(), clock.now() + duration, value, name});
  }

  std::unique_ptr<RegisterBus> wiretap() {
    return std::make_unique<WiretapBus>(spindle.bus(), writes, mute_address);
  }

  ManualClock clock;
  std::vector<std::uint16_t> writes;  ///< The values, in order.
  int mute_address = -1;              ///< Reading it is never answered.
  SimulatedSpindle spindle;
  SpindleGuard guard;
  bool at_speed_while_still = false;
  bool only_failed = true;
};

}  // namespace lensforge::testing
