// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/spindle_guard.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numeric>
#include <sstream>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "machine/guard/guard.h"
#include "machine/guard/modbus_bus.h"
#include "machine/link/link.h"

namespace lensforge {

std::size_t DeviceWatch::add(const ReadSignal& signal) {
  polled_.push_back({signal, clock_.now(), 0, {}});
  return polled_.size() - 1;
}

// The most overdue signal is read first; a slow bus then starves none.
std::vector<DeviceWatch::Reading> DeviceWatch::poll() {
  std::vector<std::size_t> order(polled_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return polled_[a].due < polled_[b].due;
  });
  std::vector<Reading> readings;
  for (const std::size_t index : order) {
    if (polled_[index].due > clock_.now() || !session_.ready()) break;
    if (!read_one(index, readings)) break;
  }
  return readings;
}

/// @return whether the device answered.
bool DeviceWatch::read_one(std::size_t index, std::vector<Reading>& readings) {
  Polled& polled = polled_[index];
  const double started = clock_.now();
  bool answered = true;
  try {
    const std::uint16_t raw = session_.read(polled.signal.at);
    readings.push_back({index, static_cast<std::uint16_t>(raw & polled.signal.mask), clock_.now()});
    polled.failures = 0;
  } catch (const BusError& error) {
    ++polled.failures;
    polled.error = error.what();
    answered = error.fault() == BusFault::kRefused;
  }
  if (answered) {
    silent_since_.reset();
    unanswered_ = 0;
    polled.due = started + polled.signal.interval;
    return true;
  }
  polled.due = clock_.now();  // behind the others: one dead register must not starve them
  ++unanswered_;
  last_error_ = polled.error;
  if (!silent_since_) silent_since_ = started;
  return false;
}

std::optional<std::string> DeviceWatch::write(const RegisterAddress& at, std::uint16_t value) {
  try {
    session_.write(at, value);
    return std::nullopt;
  } catch (const BusError& error) {
    return "writing " + std::to_string(value) + " to " + address_text(at) + ": " + error.what();
  }
}

std::string DeviceWatch::trouble(std::size_t signal) const {
  const Polled& polled = polled_[signal];
  const std::string name = polled.signal.key + " (" + address_text(polled.signal.at) + "): ";
  const int failures = std::max(polled.failures, unanswered_);
  if (failures > polled.signal.retries) {
    return name + (polled.failures == failures ? polled.error : last_error_) + ", " +
           std::to_string(failures) + " times in a row: " + std::to_string(polled.signal.retries) +
           " retries are borne";
  }
  const double silence = silent_since_ ? clock_.now() - *silent_since_ : 0.0;
  if (silence <= silence_limit_) return {};
  return name + "no good answer for " + number_text(silence, 3) + " s: at most " +
         number_text(silence_limit_, 3) + " s are borne";
}

void SpindleWatch::ask(Goal goal, double now) {
  goal_ = goal;
  asked_at_ = now;
  taken_ = false;
  command_error_.clear();
  verified_ = false;
  good_reads_ = 0;
  bad_reads_ = 0;
  at_speed_ = {};
  direction_ = {};
  latched_.clear();
  speed_trouble_.clear();
  if (goal == Goal::kSpeed) latched_ = reason();
}

void SpindleWatch::expect_speed(double rpm, bool clockwise, double now) {
  asked_rpm_ = rpm;
  clockwise_ = clockwise;
  ask(Goal::kSpeed, now);
}

void SpindleWatch::expect_stop(double now) {
  asked_rpm_ = 0.0;
  ask(Goal::kStop, now);
}

// Readings from before the command do not show its effect; the count restarts.
void SpindleWatch::command_taken(double now) {
  taken_ = true;
  good_reads_ = 0;
  streak_start_ = now;
  if (goal_ != Goal::kSpeed) speed_trouble_.clear();
}

void SpindleWatch::fail(std::string& live, const std::string& reason) {
  live = reason;
  if (goal_ == Goal::kSpeed && latched_.empty()) latched_ = reason;
}

void SpindleWatch::refuse(const std::string& reason) {
  verified_ = false;
  fail(speed_trouble_, reason);
}

void SpindleWatch::set_bus_trouble(const std::string& reason) {
  if (reason.empty()) {
    bus_trouble_.clear();
    return;
  }
  good_reads_ = 0;
  fail(bus_trouble_, reason);
}

bool SpindleWatch::speed_is_good() const {
  if (goal_ != Goal::kSpeed) return rpm_ <= map_.stopped_rpm;
  return std::abs(rpm_ - asked_rpm_) <= map_.tolerance * asked_rpm_;
}

std::string SpindleWatch::speed_text() const {
  const std::string read = "speed reads " + number_text(rpm_) + " rpm";
  if (goal_ != Goal::kSpeed) {
    return read + ": at most " + number_text(map_.stopped_rpm) + " rpm is stopped";
  }
  return read + ": " + number_text(asked_rpm_) + " rpm within " +
         number_text(100.0 * map_.tolerance) + " % was requested";
}

void SpindleWatch::see_speed(double rpm, double now) {
  rpm_ = rpm;
  if (!taken_) return;
  if (speed_is_good()) {
    if (good_reads_++ == 0) streak_start_ = now;
    bad_reads_ = 0;
  } else {
    good_reads_ = 0;
    ++bad_reads_;
  }
  if (verified_ && bad_reads_ >= map_.lost_reads) {
    fail(speed_trouble_, speed_text() + " (" + std::to_string(bad_reads_) + " readings in a row)");
  } else if (goal_ != Goal::kSpeed && bad_reads_ == 0) {
    speed_trouble_.clear();
  }
  judge(now);
}

void SpindleWatch::see_fault(std::uint16_t code, double now) {
  const bool clear = code == map_.fault->clear;
  fault_.seen = now;
  fault_.good = clear;
  if (clear) {
    fault_trouble_.clear();
  } else {
    const auto text = map_.fault->texts.find(code);
    fail(fault_trouble_,
         "fault " + std::to_string(code) + ": " +
             (text != map_.fault->texts.end() ? text->second : "no text in the register map"));
  }
  judge(now);
}

/// Beside a verified speed, a flag that is wrong as often in a row as a lost speed is a failure.
void SpindleWatch::note_flag(Flag& flag, bool good, double now, const std::string& trouble) {
  flag.seen = now;
  flag.good = good;
  flag.bad = good ? 0 : flag.bad + 1;
  if (verified_ && goal_ == Goal::kSpeed && flag.bad >= map_.lost_reads) {
    fail(speed_trouble_, trouble);
  }
  judge(now);
}

void SpindleWatch::see_at_speed(bool at_speed, double now) {
  note_flag(at_speed_, at_speed, now, "the at-speed signal is off: it must be on while cutting");
}

std::string SpindleWatch::direction_text() const {
  return std::string("does not turn ") + (clockwise_ ? "clockwise" : "counter-clockwise") +
         ", which was requested";
}

void SpindleWatch::see_direction(std::uint16_t value, double now) {
  const std::uint16_t wanted = clockwise_ ? map_.direction->forward : map_.direction->reverse;
  note_flag(direction_, value == wanted, now, direction_text());
}

bool SpindleWatch::flags_are_good() const {
  const auto fresh = [this](const Flag& flag) { return flag.good && flag.seen >= streak_start_; };
  if (map_.fault && !fresh(fault_)) return false;
  if (goal_ != Goal::kSpeed) return true;
  return (!map_.at_speed || fresh(at_speed_)) && (!map_.direction || fresh(direction_));
}

// A stop is believed without the fault register: a drive that tripped has stopped all the same.
void SpindleWatch::judge(double now) {
  if (!taken_ || good_reads_ < map_.verify_reads) return check_time(now);
  if (goal_ != Goal::kSpeed || flags_are_good()) verified_ = true;
  check_time(now);
}

/// The reason for which the request is not verified.
std::string SpindleWatch::unverified_text() const {
  if (!taken_) {
    return "the command was not taken" +
           (command_error_.empty() ? "" : " (" + command_error_ + ")");
  }
  if (good_reads_ < map_.verify_reads) return speed_text();
  if (map_.at_speed && !at_speed_.good) return "the at-speed signal stays off";
  if (map_.direction && !direction_.good) return direction_text();
  return "its other signals could not be read";
}

void SpindleWatch::check_time(double now) {
  if (verified_ || goal_ == Goal::kNone) return;
  const bool spins_up = goal_ == Goal::kSpeed;
  const double limit = spins_up ? map_.spin_up_limit : map_.spin_down_limit;
  if (now - asked_at_ <= limit || !speed_trouble_.empty()) return;
  fail(speed_trouble_, unverified_text() + " " + number_text(limit) + " s after the " +
                           (spins_up ? "start" : "stop"));
}

SpindleState SpindleWatch::state() const {
  if (!reason().empty()) return SpindleState::kFailed;
  if (!verified_) return SpindleState::kChanging;
  return goal_ == Goal::kSpeed ? SpindleState::kAtSpeed : SpindleState::kStopped;
}

// A drive that trips often loses speed before its fault is read; both are reported.
std::string SpindleWatch::reason() const {
  if (!latched_.empty() && latched_.find(fault_trouble_) == std::string::npos) {
    return latched_ + "; " + fault_trouble_;
  }
  for (const std::string* trouble : {&latched_, &fault_trouble_, &bus_trouble_, &speed_trouble_}) {
    if (!trouble->empty()) return *trouble;
  }
  return {};
}

namespace {

/// Hours of records at one per second, if they are not taken; the limit of both guards.
constexpr std::size_t kMaxRecords = 20000;

std::vector<RegisterMap> maps_of(const std::vector<GuardedDevice>& devices) {
  std::vector<RegisterMap> maps;
  maps.reserve(devices.size());
  for (const GuardedDevice& device : devices) maps.push_back(device.map);
  return maps;
}

}  // namespace

SpindleMap only_spindle(const std::vector<RegisterMap>& maps, SpindleOwner owner) {
  const SpindleMap* found = nullptr;
  std::string names;
  for (const RegisterMap& map : maps) {
    names = with_word(names, map.name);
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

// The speed is written first; the spindle never starts towards an earlier job's speed. A running
// spindle gets only the new speed: a drive such as the V20 takes the first step of its start as a
// stop.
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
    if (!trouble.empty()) all = with_word(all, trouble, "; ");
  }
  return all;
}

void SpindleGuard::read_signals() {
  for (Device& device : devices_) {
    for (const DeviceWatch::Reading& reading : device.watch.poll()) apply(device, reading);
  }
}

// Commands come before readings. While they fail, the two alternate in going first, because a
// failure puts the bus in a pause that blocks the other. A failing command thus does not block the
// interlocks' readings, and failing readings do not block a stop.
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
  if (!interlocks.empty()) report.reason = with_word(report.reason, interlocks, "; ");
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

namespace {

using Milliseconds = std::chrono::milliseconds;

/// Between two polls of the guard; its shortest interval is 10 ms.
constexpr Milliseconds kPollPause{5};

double steady_now() { return SteadyClock().now(); }

}  // namespace

BackgroundGuard::BackgroundGuard(std::unique_ptr<SpindleGuard> guard, double stale_limit)
    : guard_(std::move(guard)), stale_limit_(stale_limit), published_at_(steady_now()) {
  newest_.spindle = SpindleState::kChanging;
  newest_.interlocks_ok = false;
  newest_.reason = "the spindle and the interlocks were not read yet";
  thread_ = std::thread([this] { run(); });
}

BackgroundGuard::~BackgroundGuard() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void BackgroundGuard::spin(double rpm, bool clockwise) {
  ask([rpm, clockwise](SpindleGuard& guard) { guard.spin(rpm, clockwise); });
}

void BackgroundGuard::stop() {
  ask([](SpindleGuard& guard) { guard.stop(); });
}

// Only the last request counts: one that was not begun yet is replaced.
void BackgroundGuard::ask(Command command) {
  {
    const std::lock_guard lock(mutex_);
    command_ = std::move(command);
    answered_ = false;
    failure_unseen_.clear();
  }
  wake_.notify_all();
}

void BackgroundGuard::run() {
  std::unique_lock lock(mutex_);
  double deadline = 0.0;
  while (true) {
    const Command command = std::exchange(command_, nullptr);
    const bool ends = ends_;
    lock.unlock();
    if (ends && deadline == 0.0) deadline = steady_now() + stale_limit_;
    if (command) command(*guard_);
    const GuardReport report = guard_->poll();
    const bool done = ends && (!guard_->commands_pending() || steady_now() > deadline);
    lock.lock();
    publish(report, command_ == nullptr);
    if (done) return;
    wake_.wait_for(lock, kPollPause, [this] { return command_ != nullptr; });
  }
}

/// @param obeyed  no command has come in since this report's.
void BackgroundGuard::publish(const GuardReport& report, bool obeyed) {
  std::vector<GuardRecord> fresh = guard_->take_records();
  records_.insert(records_.end(), std::make_move_iterator(fresh.begin()),
                  std::make_move_iterator(fresh.end()));
  if (records_.size() > kMaxRecords) {
    records_.erase(records_.begin(), records_.end() - kMaxRecords);
  }
  newest_ = report;
  published_at_ = steady_now();
  answered_ = obeyed;
  if (report.spindle == SpindleState::kFailed && obeyed) failure_unseen_ = report.reason;
  if (!report.interlocks_ok) interlock_unseen_ = report.reason;
}

GuardReport BackgroundGuard::poll() {
  const std::lock_guard lock(mutex_);
  GuardReport report = newest_;
  if (!answered_) {
    report.spindle = SpindleState::kChanging;
  } else if (!failure_unseen_.empty() && report.spindle != SpindleState::kFailed) {
    report.spindle = SpindleState::kFailed;
    report.reason = failure_unseen_;
  }
  if (!interlock_unseen_.empty() && report.interlocks_ok) {
    report.interlocks_ok = false;
    report.reason = interlock_unseen_;
  }
  failure_unseen_.clear();
  interlock_unseen_.clear();
  const double age = steady_now() - published_at_;
  if (age <= stale_limit_) return report;
  std::ostringstream text;
  text << "the spindle's bus has kept its thread for " << age << " s: at most " << stale_limit_
       << " s are borne";
  return {SpindleState::kFailed, report.rpm, false, text.str()};
}

std::vector<GuardRecord> BackgroundGuard::take_records() {
  const std::lock_guard lock(mutex_);
  return std::exchange(records_, {});
}

double stale_limit_of(const std::vector<RegisterMap>& maps) {
  double silence = 0.0;
  double time_outs = 0.0;
  for (const RegisterMap& map : maps) {
    const BusTransport& to = map.transport;
    silence = std::max(silence, to.silence_limit);
    time_outs += (to.is_tcp ? to.connect_timeout : 0.0) + to.request_gap + to.response_timeout +
                 16.0 * to.byte_timeout;
  }
  return silence + time_outs;
}

std::unique_ptr<BackgroundGuard> guard_devices(const std::vector<RegisterMap>& maps,
                                               const GuardOptions& options, Clock& clock) {
  std::vector<GuardedDevice> devices;
  devices.reserve(maps.size());
  for (const RegisterMap& map : maps) {
    devices.push_back({map, std::make_unique<ModbusBus>(map.transport)});
  }
  return std::make_unique<BackgroundGuard>(
      std::make_unique<SpindleGuard>(std::move(devices), options, clock), stale_limit_of(maps));
}

}  // namespace lensforge
