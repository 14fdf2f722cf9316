// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/simulated_spindle.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

constexpr double kAnswerTime = 0.01;  // s, of a device that has a request waiting

bool same_place(const RegisterAddress& read, const RegisterAddress& at) {
  return read.function == at.function && read.address == at.address;
}

/// An interlock's value while it is open.
std::uint16_t other_value(const FlagSignal& flag) {
  return flag.expected == 0 ? flag.signal.mask : std::uint16_t{0};
}

}  // namespace

/// One connection; a late answer waits in it and passes for the answer to the next request.
class SimulatedSpindle::Bus final : public RegisterBus {
 public:
  explicit Bus(SimulatedSpindle& spindle) : spindle_(spindle) {}

  void open() override {
    if (spindle_.active(SpindleTrouble::kDown, now()) != nullptr) fail_down();
    open_ = true;
  }
  void close() override {
    open_ = false;
    late_.reset();
  }
  [[nodiscard]] bool is_open() const override { return open_; }
  void discard() override {
    if (late_ && late_->arrives <= now()) late_.reset();
  }

  std::uint16_t read(const RegisterAddress& at) override {
    begin();
    spindle_.advance();
    const std::uint16_t value = spindle_.value_at(at);
    if (late_ && late_->arrives <= now() + time_out()) {
      const Late wrong = *late_;
      late_ = Late{wrong.arrives + kAnswerTime, value};  // ... and so on, one behind
      return wrong.value;
    }
    answer(value);
    return value;
  }

  void write(const RegisterAddress& at, std::uint16_t value) override {
    begin();
    spindle_.advance();
    if (spindle_.active(SpindleTrouble::kWrongEcho, now()) != nullptr) {
      throw BusError(BusFault::kGarbled, "echoed another value than was written");
    }
    spindle_.obey(at, value);
    answer(value);
  }

 private:
  struct Late {
    double arrives;
    std::uint16_t value;
  };

  [[nodiscard]] double now() const { return spindle_.clock_.now(); }
  [[nodiscard]] double time_out() const { return spindle_.map_.transport.response_timeout; }

  [[noreturn]] void fail_down() {
    close();
    throw BusError(BusFault::kDown, "the connection is down");
  }

  void begin() {
    ++spindle_.exchanges_;
    if (spindle_.active(SpindleTrouble::kDown, now()) != nullptr) fail_down();
    if (spindle_.active(SpindleTrouble::kRefuses, now()) != nullptr) {
      throw BusError(BusFault::kRefused, "refused: illegal data address");
    }
  }

  void answer(std::uint16_t value) {
    const SpindleScript* late = spindle_.active(SpindleTrouble::kLate, now());
    const bool silent = spindle_.active(SpindleTrouble::kSilent, now()) != nullptr;
    if (!silent && (late == nullptr || late->value <= time_out())) return;
    if (!silent) late_ = Late{now() + late->value, value};
    throw BusError(BusFault::kSilent, "no answer in time");
  }

  SimulatedSpindle& spindle_;
  bool open_ = false;
  std::optional<Late> late_;
};

SimulatedSpindle::SimulatedSpindle(const RegisterMap& map, Clock& clock, double ramp)
    : map_(map), clock_(clock), ramp_(ramp), time_(clock.now()) {}

std::unique_ptr<RegisterBus> SimulatedSpindle::bus() { return std::make_unique<Bus>(*this); }

void SimulatedSpindle::drive(double rpm, bool clockwise) {
  advance();
  runs_ = rpm > 0.0;
  asked_rpm_ = rpm;
  clockwise_ = clockwise;
}

double SimulatedSpindle::rpm() {
  advance();
  return rpm_;
}

const SpindleScript* SimulatedSpindle::active(SpindleTrouble trouble, double time) const {
  for (const SpindleScript& script : scripts_) {
    if (script.trouble == trouble && script.at <= time && time < script.until) return &script;
  }
  return nullptr;
}

/// The first moment after `after` and before `before` at which a trouble begins or ends.
double SimulatedSpindle::next_change(double after, double before) const {
  double next = before;
  for (const SpindleScript& script : scripts_) {
    for (const double time : {script.at, script.until}) {
      if (time > after) next = std::min(next, time);
    }
  }
  return next;
}

void SimulatedSpindle::advance() {
  const double now = clock_.now();
  while (time_ < now) {
    const double next = next_change(time_, now);
    move(time_, next);
    time_ = next;
  }
}

void SimulatedSpindle::move(double from, double to) {
  double target = asked_rpm() * (clockwise_ ? 1.0 : -1.0);
  if (const SpindleScript* sag = active(SpindleTrouble::kSag, from)) target *= sag->value;
  if (active(SpindleTrouble::kFault, from) != nullptr) {
    runs_ = false;  // a drive that tripped waits for a new start
    target = 0.0;
  }
  const bool held = active(SpindleTrouble::kStall, from) != nullptr ||
                    active(SpindleTrouble::kLies, from) != nullptr;
  if (held) target = 0.0;
  const double most = (held ? 10.0 : 1.0) * ramp_ * (to - from);
  rpm_ += std::clamp(target - rpm_, -most, most);
}

void SimulatedSpindle::put(const ReadSignal& signal, const RegisterAddress& at, std::uint16_t bits,
                           std::optional<std::uint16_t>& raw) const {
  if (!same_place(signal.at, at)) return;
  raw = static_cast<std::uint16_t>((raw.value_or(0) & ~signal.mask) | (bits & signal.mask));
}

void SimulatedSpindle::put_spindle(const RegisterAddress& at,
                                   std::optional<std::uint16_t>& raw) const {
  const SpindleMap& spindle = *map_.spindle;
  const double now = clock_.now();
  put(spindle.speed.signal, at,
      raw_of_rpm(spindle.speed.scale, spindle.rpm_per_hz, std::abs(rpm_)).value_or(0), raw);
  if (spindle.fault) {
    const SpindleScript* fault = active(SpindleTrouble::kFault, now);
    put(spindle.fault->signal, at,
        fault != nullptr ? static_cast<std::uint16_t>(fault->value) : spindle.fault->clear, raw);
  }
  const bool lies = active(SpindleTrouble::kLies, now) != nullptr;
  const bool reached = runs_ && std::abs(std::abs(rpm_) - asked_rpm_) < 0.01 * asked_rpm_;
  if (spindle.at_speed) {
    const FlagSignal& flag = *spindle.at_speed;
    put(flag.signal, at, lies || reached ? flag.expected : other_value(flag), raw);
  }
  if (spindle.direction) {
    const bool forward = lies || rpm_ == 0.0 ? clockwise_ : rpm_ > 0.0;
    put(spindle.direction->signal, at,
        forward ? spindle.direction->forward : spindle.direction->reverse, raw);
  }
}

// Signals may share a register, each with its mask.
std::uint16_t SimulatedSpindle::value_at(const RegisterAddress& at) {
  std::optional<std::uint16_t> raw;
  if (map_.spindle) put_spindle(at, raw);
  for (const Interlock& interlock : map_.interlocks) {
    const SpindleScript* open = nullptr;
    for (const SpindleScript& script : scripts_) {
      if (script.trouble == SpindleTrouble::kInterlock && script.name == interlock.name &&
          script.at <= clock_.now() && clock_.now() < script.until) {
        open = &script;
      }
    }
    put(interlock.flag.signal, at,
        open != nullptr ? other_value(interlock.flag) : interlock.flag.expected, raw);
  }
  if (!raw) throw BusError(BusFault::kRefused, "refused: illegal data address");
  return *raw;
}

bool SimulatedSpindle::is_last_step(const std::vector<WriteStep>& steps, const RegisterAddress& at,
                                    std::uint16_t value) const {
  return !steps.empty() && same_place(steps.back().at, at) && steps.back().value == value;
}

void SimulatedSpindle::obey(const RegisterAddress& at, std::uint16_t value) {
  if (!map_.spindle || !map_.spindle->commands) {
    throw BusError(BusFault::kRefused, "refused: illegal data address");
  }
  const SpindleCommands& commands = *map_.spindle->commands;
  if (same_place(commands.set_speed, at)) {
    speed_register_rpm_ = rpm_of_raw(commands.scale, map_.spindle->rpm_per_hz, value);
    if (runs_) asked_rpm_ = speed_register_rpm_;
    return;
  }
  const bool forward = is_last_step(commands.run_forward, at, value);
  if (forward || is_last_step(commands.run_reverse, at, value)) {
    drive(speed_register_rpm_, forward);
  } else if (is_last_step(commands.stop, at, value)) {
    drive(0.0, clockwise_);
  }
}

}  // namespace lensforge
