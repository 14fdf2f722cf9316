// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/sender.h"

#include <algorithm>

#include "machine/stream/realtime.h"

namespace lensforge {
namespace {

/// A link that takes nothing is tried again after this, s.
constexpr double kWriteAgain = 0.002;
/// Spindle and interlocks are looked at this often; their own poll intervals rule the bus, s.
constexpr double kGuardInterval = 0.05;
/// Longest time without a look at the stop token and the keys, s.
constexpr double kStopCheck = 0.1;
/// Grbl tells "Idle" between taking a motion and starting it, hence more than one.
constexpr int kIdleReports = 2;
/// A ? that got lost is asked again after this, s.
constexpr double kAskAgain = 1.0;

/// The longest step of each axis: a motion that is longer is a block of the planner for sure.
double block_travel(const ControllerInfo& info) {
  double longest = 0.0;
  for (const int axis : {100, 101, 102}) {
    const double steps_per_mm = info.setting(axis).value_or(0.0);
    if (steps_per_mm > 0.0) longest = std::max(longest, 1.0 / steps_per_mm);
  }
  return longest;
}

TrackerOptions tracker_options(const ControllerInfo& info, std::int64_t first_line) {
  return {first_line, info.planner_blocks, block_travel(info), info.dialect.max_line_number};
}

char realtime_byte(OperatorKey key) {
  switch (key) {
    case OperatorKey::kHold:
      return realtime::kFeedHold;
    case OperatorKey::kResume:
      return realtime::kCycleStart;
    case OperatorKey::kFeedUp:
      return realtime::kFeedUp10;
    case OperatorKey::kFeedDown:
      return realtime::kFeedDown10;
    case OperatorKey::kFeedNormal:
      return realtime::kFeedTo100;
    case OperatorKey::kRapidFull:
      return realtime::kRapidTo100;
    case OperatorKey::kRapidHalf:
      return realtime::kRapidTo50;
    case OperatorKey::kRapidQuarter:
      return realtime::kRapidTo25;
    case OperatorKey::kSpindleUp:
      return realtime::kSpindleUp10;
    case OperatorKey::kSpindleDown:
      return realtime::kSpindleDown10;
    case OperatorKey::kSpindleNormal:
      break;
  }
  return realtime::kSpindleTo100;
}

bool of_spindle(OperatorKey key) {
  return key == OperatorKey::kSpindleUp || key == OperatorKey::kSpindleDown ||
         key == OperatorKey::kSpindleNormal;
}

}  // namespace

Sender::Sender(const SenderParts& parts, const ControllerInfo& info, const SenderOptions& options,
               std::int64_t first_line)
    : wire_(parts.wire),
      clock_(parts.clock),
      guard_(parts.guard),
      journal_(parts.journal),
      info_(info),
      options_(options),
      tracker_(tracker_options(info, first_line)),
      audit_(info.rx_bytes) {}

SendResult Sender::run(ProgramFeed& feed, const SendControl& control) {
  feed_ = &feed;
  control_ = &control;
  started_ = progress_at_ = clock_.now();
  try {
    while (phase_ != Phase::kDone) step();
    return end(SendStatus::kDone, StopCause::kNone, "the program came to its end");
  } catch (const StreamFault& fault) {
    return stop_for(fault.cause(), fault.what());
  } catch (const LinkLost& lost) {
    return stop_for(StopCause::kLinkLost, lost.what());
  } catch (const JournalFailed& failed) {
    return stop_for(StopCause::kJournal, failed.what());
  } catch (const std::runtime_error& refused) {
    return stop_for(StopCause::kProgram, refused.what());
  }
}

void Sender::step() {
  if (control_->reset.stop_requested() || control_->stop.stop_requested()) {
    throw StreamFault(StopCause::kInterrupted, "interrupted");
  }
  obey_operator();
  fill();
  wire_.flush();
  wire_.receive(wait_time(), [this](const Reply& reply) { take(reply); });
  watch_guard();
  ask_status();
  watch_for_stall();
}

void Sender::fill() {
  while (phase_ == Phase::kStreaming && !held_ && (guard_ == nullptr || guard_ready_)) {
    if (!next_) next_ = feed_->next();
    if (!next_) {
      phase_ = Phase::kEnding;
      return;
    }
    if (next_->barrier && !drained()) return;
    if (!room_for(*next_)) return;
    hand_over();
  }
  if (phase_ == Phase::kEnding && drained()) {
    tracker_.all_done();
    phase_ = Phase::kDone;
  }
}

bool Sender::room_for(const OutgoingLine& line) const {
  if (tracker_.empty()) return !wire_.waiting();
  if (!options_.character_counting || line.alone || tracker_.alone()) return false;
  const std::size_t bytes = tracker_.bytes() + line.text.size() + 1;
  return bytes <= static_cast<std::size_t>(info_.rx_bytes);
}

bool Sender::drained() const { return tracker_.empty() && idle_reports_ >= kIdleReports; }

void Sender::hand_over() {
  if (next_->cuts && !(spindle_.turning() && verified_)) {
    throw StreamFault(StopCause::kSpindle, "line " + std::to_string(next_->line) +
                                               " moves at feed, but the spindle is not verified "
                                               "to turn");
  }
  if (journal_ != nullptr) journal_->before_sending(next_->line);
  if (next_->barrier) {
    barrier_ = *next_;
    phase_ = Phase::kAnswer;
    command_spindle();
  }
  const double now = clock_.now();
  // Time during which there was nothing to wait for is no stall.
  if (tracker_.empty()) progress_at_ = now;
  wire_.line(next_->text);
  tracker_.send(*next_, now);
  idle_reports_ = 0;
  stale_ = true;
  next_.reset();
}

/// Before the line itself leaves, so that a guard which only watches knows what is to come.
void Sender::command_spindle() {
  if (!barrier_.spindle) return;
  spindle_ = *barrier_.spindle;
  verified_ = false;
  if (guard_ == nullptr) return;
  if (spindle_.turning()) {
    guard_->spin(spindle_.rpm, spindle_.turn == SpindleTurn::kClockwise);
  } else {
    guard_->stop();
  }
}

void Sender::obey_operator() {
  if (!control_->keys) return;
  while (const std::optional<OperatorKey> key = control_->keys()) obey(*key);
}

void Sender::obey(OperatorKey key) {
  if (of_spindle(key) && guard_ != nullptr) {
    return note("no override of the spindle: its speed is verified over Modbus");
  }
  wire_.urgent(realtime_byte(key));
  if (key == OperatorKey::kHold) held_by_operator_ = true;
  if (key == OperatorKey::kResume) held_by_operator_ = false;
}

double Sender::wait_time() const {
  if (wire_.waiting()) return kWriteAgain;
  const double now = clock_.now();
  double due = std::min(status_due_, now + kStopCheck);
  if (guard_ != nullptr) due = std::min(due, guard_due_);
  return std::max(due - now, 0.0);
}

void Sender::ask_status() {
  const double now = clock_.now();
  if (now < status_due_) return;
  if (asked_since_ && now - *asked_since_ > options_.reply_timeout) {
    throw StreamFault(StopCause::kStall, "the controller has not answered ? for " +
                                             std::to_string(static_cast<int>(now - *asked_since_)) +
                                             " s");
  }
  wire_.urgent(realtime::kStatusReport);
  status_due_ = now + (asked_since_ ? kAskAgain : std::max(options_.status_interval, 0.2));
  if (!asked_since_) {
    asked_since_ = now;
    stale_ = false;
  }
}

void Sender::watch_guard() {
  if (guard_ == nullptr || clock_.now() < guard_due_) return;
  guard_due_ = clock_.now() + kGuardInterval;
  guarded_ = guard_->poll();
  take_guard_records();
  guard_ready_ = guard_ready_ || guarded_.interlocks_ok;
  const bool may_be_unread = !guard_ready_ && clock_.now() - started_ <= options_.guard_timeout;
  if (!guarded_.interlocks_ok && !may_be_unread) {
    throw StreamFault(StopCause::kInterlock, guarded_.reason);
  }
  const bool watched = spindle_.turning() && phase_ != Phase::kSpindle && verified_;
  if (watched && guarded_.spindle != SpindleState::kAtSpeed) {
    throw StreamFault(StopCause::kSpindle, "the spindle lost its speed: " + guarded_.reason + ", " +
                                               std::to_string(static_cast<int>(guarded_.rpm)) +
                                               " rpm read");
  }
  if (phase_ == Phase::kSpindle) verify_spindle();
}

/// Speeds come by the second: the journal has them in its progress already.
void Sender::take_guard_records() {
  for (const GuardRecord& record : guard_->take_records()) {
    if (record.event == GuardEvent::kSpeed) {
      const std::string rpm = std::to_string(static_cast<int>(record.rpm));
      tell(SendEventKind::kReading, "the spindle turns at " + rpm + " rpm");
    } else if (!record.text.empty()) {
      note(record.text);
    } else {
      note(record.event == GuardEvent::kInterlock ? "all interlocks are as they should be"
                                                  : "the trouble with the spindle is over");
    }
  }
}

}  // namespace lensforge
