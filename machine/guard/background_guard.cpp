// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/background_guard.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <sstream>
#include <utility>

#include "machine/guard/modbus_bus.h"
#include "machine/link/link.h"

namespace lensforge {
namespace {

using Milliseconds = std::chrono::milliseconds;

/// Between two polls of the guard; its shortest interval is 10 ms.
constexpr Milliseconds kPollPause{5};
/// Same limit as in SpindleGuard.
constexpr std::size_t kMaxRecords = 20000;

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
