// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/spindle_guard.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"
#include "machine/guard/spindle_state_name.h"

namespace lensforge {
namespace {

/// Hours of records at one a second, if nobody takes them.
constexpr std::size_t kMaxRecords = 20000;

std::vector<RegisterMap> maps_of(const std::vector<GuardedDevice>& devices) {
  std::vector<RegisterMap> maps;
  for (const GuardedDevice& device : devices) maps.push_back(device.map);
  return maps;
}

}  // namespace

SpindleMap only_spindle(const std::vector<RegisterMap>& maps, SpindleOwner owner) {
  const SpindleMap* found = nullptr;
  std::string names;
  for (const RegisterMap& map : maps) {
    names += (names.empty() ? "" : ", ") + map.name;
    if (!map.spindle) continue;
    if (found != nullptr)
      throw InputError("register maps " + names + ": only one may have a spindle");
    found = &*map.spindle;
    if (owner == SpindleOwner::kHost && !found->commands) {
      throw InputError("register map " + map.name +
                       ": has no spindle.commands, which a host-driven spindle needs; let the "
                       "controller drive it, or add them");
    }
  }
  if (found == nullptr) {
    throw InputError("register maps " + names + ": one must have a spindle, to verify its speed");
  }
  return *found;
}

SpindleGuard::SpindleGuard(std::vector<GuardedDevice> devices, const GuardOptions& options,
                           Clock& clock)
    : options_(options),
      clock_(clock),
      spindle_map_(only_spindle(maps_of(devices), options.owner)),
      watch_(spindle_map_),
      speed_recorded_at_(clock.now()) {
  reported_.spindle = SpindleState::kChanging;
  for (GuardedDevice& device : devices) add_device(std::move(device));
}

void SpindleGuard::add_device(GuardedDevice device) {
  const BusTransport& transport = device.map.transport;
  Device added{device.map.name,
               DeviceWatch(BusSession(std::move(device.bus), transport, clock_),
                           transport.silence_limit, clock_),
               {}};
  if (device.map.spindle) {
    spindle_device_ = devices_.size();
    add_spindle(added, *device.map.spindle);
  }
  add_interlocks(added, device.map.interlocks);
  devices_.push_back(std::move(added));
}

void SpindleGuard::add_spindle(Device& device, const SpindleMap& map) {
  const auto add = [&device](const ReadSignal& signal, Role role) {
    device.watch.add(signal);
    device.meanings.push_back({role, 0});
  };
  add(map.speed.signal, Role::kSpeed);
  if (map.fault) add(map.fault->signal, Role::kFault);
  if (map.at_speed) add(map.at_speed->signal, Role::kAtSpeed);
  if (map.direction) add(map.direction->signal, Role::kDirection);
}

void SpindleGuard::add_interlocks(Device& device, const std::vector<Interlock>& interlocks) {
  for (const Interlock& interlock : interlocks) {
    const std::size_t signal = device.watch.add(interlock.flag.signal);
    device.meanings.push_back({Role::kInterlock, interlocks_.size()});
    interlocks_.push_back({devices_.size(), signal, interlock.flag.expected, false, 0});
    interlock_names_.push_back(interlock.name);
  }
}

std::string SpindleGuard::refusal(double rpm, bool clockwise) const {
  if (!(rpm >= spindle().rpm_min) || !(rpm <= spindle().rpm_max)) {
    return number_text(rpm) + " rpm: the spindle turns at " + number_text(spindle().rpm_min) +
           " to " + number_text(spindle().rpm_max) + " rpm";
  }
  if (options_.owner == SpindleOwner::kHost && !clockwise &&
      spindle().commands->run_reverse.empty()) {
    return "counter-clockwise: the register map has no run_reverse";
  }
  return {};
}

// The speed goes first, so that the spindle never starts towards the speed of an earlier job. One
// that runs is given only the new speed: a drive such as the V20 takes the first step of its start
// for a stop.
std::deque<WriteStep> SpindleGuard::start_steps(double rpm, bool clockwise) const {
  const SpindleCommands& commands = *spindle().commands;
  std::deque<WriteStep> steps{
      {commands.set_speed, *raw_of_rpm(commands.scale, spindle().rpm_per_hz, rpm)}};
  const Running wanted = clockwise ? Running::kClockwise : Running::kCounterClockwise;
  if (running_ == wanted && watch_.state() != SpindleState::kFailed) return steps;
  const std::vector<WriteStep>& run = clockwise ? commands.run_forward : commands.run_reverse;
  steps.insert(steps.end(), run.begin(), run.end());
  return steps;
}

void SpindleGuard::spin(double rpm, bool clockwise) {
  const std::string refused = refusal(rpm, clockwise);
  const bool writes = options_.owner == SpindleOwner::kHost && refused.empty();
  pending_ = writes ? start_steps(rpm, clockwise) : std::deque<WriteStep>{};
  stopping_ = false;
  failed_writes_ = 0;
  asked_ = clockwise ? Running::kClockwise : Running::kCounterClockwise;
  const double now = clock_.now();
  watch_.expect_speed(rpm, clockwise, now);
  record(GuardEvent::kCommand, std::string("spin ") + number_text(rpm) + " rpm " +
                                   (clockwise ? "clockwise" : "counter-clockwise"));
  if (!refused.empty()) watch_.refuse(refused);
  if (options_.owner == SpindleOwner::kController) watch_.command_taken(now);
  give_up_failed_start();
}

// A start that has failed must not reach the drive minutes later, when the bus is back and a hand
// is near the tool; a stop that comes late does no harm.
void SpindleGuard::give_up_failed_start() {
  if (!stopping_ && watch_.state() == SpindleState::kFailed) pending_.clear();
}

void SpindleGuard::stop() {
  const double now = clock_.now();
  pending_.clear();
  stopping_ = true;
  failed_writes_ = 0;
  asked_ = Running::kNo;
  running_ = Running::kNo;
  watch_.expect_stop(now);
  record(GuardEvent::kCommand, "stop");
  if (options_.owner == SpindleOwner::kController) {
    watch_.command_taken(now);
    return;
  }
  const std::vector<WriteStep>& steps = spindle().commands->stop;
  pending_.assign(steps.begin(), steps.end());
}

void SpindleGuard::send_commands() {
  DeviceWatch& device = devices_[spindle_device_].watch;
  while (!pending_.empty() && device.ready()) {
    const WriteStep step = pending_.front();
    const std::optional<std::string> error = device.write(step.at, step.value);
    if (error) return command_failed(*error);
    failed_writes_ = 0;
    pending_.pop_front();
    if (!pending_.empty()) continue;
    running_ = asked_;
    watch_.command_taken(clock_.now());
  }
}

void SpindleGuard::command_failed(const std::string& error) {
  ++failed_writes_;
  watch_.command_failed(error);
  const int retries = spindle().commands->retries;
  if (failed_writes_ <= retries) return;
  watch_.refuse(error + ", " + std::to_string(failed_writes_) +
                " times in a row: " + std::to_string(retries) + " retries are borne");
}

void SpindleGuard::apply(Device& device, const DeviceWatch::Reading& reading) {
  const Meaning& meaning = device.meanings[reading.signal];
  switch (meaning.role) {
    case Role::kSpeed:
      return watch_.see_speed(
          rpm_of_raw(spindle().speed.scale, spindle().rpm_per_hz, reading.value), reading.time);
    case Role::kFault:
      return watch_.see_fault(reading.value, reading.time);
    case Role::kAtSpeed:
      return watch_.see_at_speed(reading.value == spindle().at_speed->expected, reading.time);
    case Role::kDirection:
      return watch_.see_direction(reading.value, reading.time);
    case Role::kInterlock:
      interlocks_[meaning.interlock].was_read = true;
      interlocks_[meaning.interlock].value = reading.value;
  }
}

std::string SpindleGuard::spindle_bus_trouble() const {
  const Device& device = devices_[spindle_device_];
  for (std::size_t i = 0; i < device.meanings.size(); ++i) {
    if (device.meanings[i].role == Role::kInterlock) continue;
    std::string trouble = device.watch.trouble(i);
    if (!trouble.empty()) return trouble;
  }
  return {};
}

std::string SpindleGuard::interlock_trouble(const WatchedInterlock& interlock,
                                            const std::string& name) const {
  const Device& device = devices_[interlock.device];
  const std::string trouble = device.watch.trouble(interlock.signal);
  if (!trouble.empty()) return device.name + ": " + trouble;
  if (!interlock.was_read) return device.name + ": " + name + ": not read yet";
  if (interlock.value == interlock.expected) return {};
  return device.name + ": " + name + ": reads " + std::to_string(interlock.value) + ": " +
         std::to_string(interlock.expected) + " is needed";
}

std::string SpindleGuard::interlock_trouble() const {
  std::string all;
  for (std::size_t i = 0; i < interlocks_.size(); ++i) {
    const std::string trouble = interlock_trouble(interlocks_[i], interlock_names_[i]);
    if (!trouble.empty()) all += (all.empty() ? "" : "; ") + trouble;
  }
  return all;
}

void SpindleGuard::read_signals() {
  for (Device& device : devices_) {
    for (const DeviceWatch::Reading& reading : device.watch.poll()) apply(device, reading);
  }
}

// Commands go before readings. While they fail, the two take turns at starting, as the one that
// fails leaves the bus in a pause and the other nothing to do: a command that is not taken keeps no
// interlock from being read, and readings that fail keep no stop from being tried.
void SpindleGuard::exchange() {
  const bool ready = devices_[spindle_device_].watch.ready();
  const bool commands_first = commands_first_;
  if (commands_first) send_commands();
  read_signals();
  if (!commands_first) send_commands();
  if (ready) commands_first_ = failed_writes_ == 0 || !commands_first;
}

GuardReport SpindleGuard::poll() {
  exchange();
  watch_.set_bus_trouble(spindle_bus_trouble());
  watch_.check_time(clock_.now());
  give_up_failed_start();
  const std::string interlocks = interlock_trouble();
  GuardReport report{watch_.state(), watch_.rpm(), interlocks.empty(), watch_.reason()};
  if (!report.reason.empty()) report.reason = devices_[spindle_device_].name + ": " + report.reason;
  record_changes(report, interlocks);
  if (!interlocks.empty()) report.reason += (report.reason.empty() ? "" : "; ") + interlocks;
  return report;
}

void SpindleGuard::record(GuardEvent event, const std::string& text) {
  if (records_.size() == kMaxRecords) records_.pop_front();
  records_.push_back({clock_.now(), event, watch_.rpm(), text});
}

void SpindleGuard::record_changes(const GuardReport& report, const std::string& interlock_trouble) {
  if (report.spindle != reported_.spindle) {
    record(GuardEvent::kState, spindle_state_name(report.spindle));
  }
  if (report.reason != reported_.reason) record(GuardEvent::kTrouble, report.reason);
  if (interlock_trouble != reported_interlock_) {
    record(GuardEvent::kInterlock, interlock_trouble);
  }
  const double moved = std::abs(report.rpm - speed_recorded_);
  const bool elapsed = clock_.now() - speed_recorded_at_ >= options_.record_interval;
  if ((elapsed && (report.rpm > 0.0 || moved > 0.0)) ||
      moved > std::max(1.0, options_.record_change * spindle().rpm_max)) {
    record(GuardEvent::kSpeed, {});
    speed_recorded_ = report.rpm;
    speed_recorded_at_ = clock_.now();
  }
  reported_ = report;
  reported_interlock_ = interlock_trouble;
}

std::vector<GuardRecord> SpindleGuard::take_records() {
  std::vector<GuardRecord> taken(std::make_move_iterator(records_.begin()),
                                 std::make_move_iterator(records_.end()));
  records_.clear();
  return taken;
}

}  // namespace lensforge
