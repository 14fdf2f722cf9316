// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/sender.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "machine/guard/guard.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/journal.h"
#include "machine/stream/send_steps.h"

namespace lensforge {
namespace {

/// One run of a Sender: carries out what the steps decide (send_steps.h), and turns what comes in
/// into steps. It decides nothing itself.
class SendRun {
 public:
  /// All arguments except `first_line` must outlive the run.
  SendRun(const SenderParts& parts, const SendRules& rules, std::int64_t first_line,
          ProgramFeed& feed, const SendControl& control);

  SendResult run();

 private:
  void turn();
  void obey_operator();
  void obey(OperatorKey key);
  void fill();
  void hand_over();
  void take(const Reply& reply);
  void take_ok();
  void take_status(const StatusReport& report);
  void poll_guard();
  void take_guard_records();
  void ask_status();
  /// Takes over a step's state, reports its notes and stops for its fault. @throw StreamFault
  void apply(SendStep step);
  void note(const std::string& text);
  void tell(SendEventKind kind, const std::string& message);
  [[nodiscard]] JobProgress progress() const;
  [[nodiscard]] double rpm_seen() const;

  // Ends the run.
  SendResult end(SendStatus status, StopCause cause, std::string reason);
  SendResult stop_for(StopCause cause, std::string reason);
  void hold(StopCause cause, const std::string& reason);
  void reset();
  /// @return whether the controller greeted.
  bool take_while_stopping(double wait);

  SenderParts parts_;
  SendRules rules_;
  ProgramFeed& feed_;
  const SendControl& control_;
  LineTracker tracker_;
  BufferAudit audit_;
  SendState state_;
  std::optional<OutgoingLine> next_;  ///< Read, and not handed over yet.
};

/// Spindle and interlocks are looked at this often; their own poll intervals rule the bus, s.
constexpr double kGuardInterval = 0.05;

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

void order_spindle(Guard& guard, const SpindleOrder& order) {
  if (!order.turning()) return guard.stop();
  guard.spin(order.rpm, order.turn == SpindleTurn::kClockwise);
}

SendRun::SendRun(const SenderParts& parts, const SendRules& rules, std::int64_t first_line,
                 ProgramFeed& feed, const SendControl& control)
    : parts_(parts),
      rules_(rules),
      feed_(feed),
      control_(control),
      tracker_(tracker_options(rules.info, first_line)),
      audit_(rules.info.rx_bytes) {
  state_.started = state_.progress_at = parts_.clock.now();
}

SendResult SendRun::run() {
  try {
    while (state_.phase != SendPhase::kDone) turn();
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

void SendRun::turn() {
  if (control_.reset.stop_requested() || control_.stop.stop_requested()) {
    throw StreamFault(StopCause::kInterrupted, "interrupted");
  }
  obey_operator();
  fill();
  parts_.wire.flush();
  const double wait =
      send_step::wait_time(state_, rules_.guarded, parts_.wire.waiting(), parts_.clock.now());
  parts_.wire.receive(wait, [this](const Reply& reply) { take(reply); });
  poll_guard();
  ask_status();
  apply(
      send_step::watch_for_stall(std::move(state_), tracker_, rules_.options, parts_.clock.now()));
}

void SendRun::apply(SendStep step) {
  state_ = std::move(step.state);
  for (const std::string& text : step.notes) note(text);
  if (step.fault) throw StreamFault(*step.fault);
}

void SendRun::obey_operator() {
  if (!control_.keys) return;
  while (const std::optional<OperatorKey> key = control_.keys()) obey(*key);
}

void SendRun::obey(OperatorKey key) {
  if (of_spindle(key) && rules_.guarded) {
    return note("no override of the spindle: its speed is verified over Modbus");
  }
  parts_.wire.urgent(realtime_byte(key));
  if (key == OperatorKey::kHold) state_.hold.by_operator = true;
  if (key == OperatorKey::kResume) state_.hold.by_operator = false;
}

void SendRun::fill() {
  while (send_step::may_send(state_, rules_)) {
    if (!next_) next_ = feed_.next();
    if (!next_) {
      state_.phase = SendPhase::kEnding;
      break;
    }
    if (next_->barrier && !send_step::drained(state_, tracker_)) return;
    if (!send_step::has_room(*next_, tracker_, rules_, parts_.wire.waiting())) return;
    hand_over();
  }
  if (state_.phase != SendPhase::kEnding || !send_step::drained(state_, tracker_)) return;
  tracker_.all_done();
  state_.phase = SendPhase::kDone;
}

/// Journal and guard come first: every line is recorded before it is sent, and a guard that only
/// watches knows the next command.
void SendRun::hand_over() {
  const OutgoingLine line = *std::exchange(next_, std::nullopt);
  if (const auto fault = send_step::cut_fault(state_, line, rules_)) throw StreamFault(*fault);
  if (parts_.journal != nullptr) parts_.journal->before_sending(line.line);
  const double now = parts_.clock.now();
  state_ = send_step::handed_over(std::move(state_), line, tracker_.empty(), now);
  if (line.barrier && line.spindle && parts_.guard != nullptr) {
    order_spindle(*parts_.guard, *line.spindle);
  }
  parts_.wire.line(line.text);
  tracker_.send(line, now);
}

void SendRun::take(const Reply& reply) {
  if (reply.kind == Reply::Kind::kOk) return take_ok();
  if (reply.kind == Reply::Kind::kStatus) return take_status(*reply.status);
  apply(send_step::other_reply(std::move(state_), reply, tracker_.oldest_line()));
}

void SendRun::take_ok() {
  if (tracker_.empty()) {
    throw StreamFault(StopCause::kCountMismatch, "an ok came, but no line waits for one");
  }
  tracker_.acknowledge();
  const bool last = tracker_.empty();
  if (send_step::passes_barrier(state_, last)) tracker_.all_done();
  state_ = send_step::acknowledged(std::move(state_), last, parts_.clock.now());
}

void SendRun::take_status(const StatusReport& report) {
  const double now = parts_.clock.now();
  apply(send_step::reported(std::move(state_), report, rules_, now));
  tracker_.report(report, at_rest(report), now);
  state_ = send_step::count_idle(std::move(state_), rules_.info);
  if (rules_.options.character_counting) {
    const std::string mismatch = audit_.check(report, tracker_, now);
    if (!mismatch.empty()) throw StreamFault(StopCause::kCountMismatch, mismatch);
  }
  if (send_step::drained(state_, tracker_)) tracker_.all_done();
  if (!rules_.guarded && state_.phase == SendPhase::kSpindle) {
    apply(send_step::verify_spindle(std::move(state_), rules_, now));
  }
  if (parts_.journal != nullptr) parts_.journal->progress(progress());
  tell(SendEventKind::kStatus, {});
}

void SendRun::poll_guard() {
  if (parts_.guard == nullptr || parts_.clock.now() < state_.guard.due) return;
  state_.guard.due = parts_.clock.now() + kGuardInterval;
  state_.guard.report = parts_.guard->poll();
  take_guard_records();
  const double now = parts_.clock.now();
  apply(send_step::guarded(std::move(state_), rules_.options, now));
  if (state_.phase == SendPhase::kSpindle) {
    apply(send_step::verify_spindle(std::move(state_), rules_, now));
  }
}

/// Speeds come by the second: the journal has them in its progress already.
void SendRun::take_guard_records() {
  for (const GuardRecord& record : parts_.guard->take_records()) {
    if (record.event == GuardEvent::kSpeed) {
      const std::string rpm = std::to_string(static_cast<int>(record.rpm));
      tell(SendEventKind::kReading, "the spindle turns at " + rpm + " rpm");
    } else if (!record.text.empty()) {
      note(record.text);
    } else {
      note(record.event == GuardEvent::kInterlock ? "all interlocks are in their required state"
                                                  : "the trouble with the spindle is over");
    }
  }
}

void SendRun::ask_status() {
  send_step::Question question =
      send_step::ask_status(std::move(state_), rules_.options, parts_.clock.now());
  state_ = std::move(question.state);
  if (question.fault) throw StreamFault(*question.fault);
  if (question.ask) parts_.wire.urgent(realtime::kStatusReport);
}

void SendRun::note(const std::string& text) {
  if (parts_.journal != nullptr) parts_.journal->note(tracker_.executed(), text);
  tell(SendEventKind::kNote, text);
}

void SendRun::tell(SendEventKind kind, const std::string& message) {
  if (!control_.watch) return;
  SendEvent event;
  event.kind = kind;
  event.report = state_.status.report;
  event.position = state_.status.position;
  event.sent = tracker_.sent();
  event.acknowledged = tracker_.acknowledged();
  event.executed = tracker_.executed();
  event.byte = tracker_.offset();
  const SpindleOrder& order = state_.spindle.order;
  event.rpm_asked = order.turning() ? order.rpm : 0.0;
  event.rpm_seen = rpm_seen();
  event.rpm_is_measured = rules_.guarded || state_.status.report.measured_rpm.has_value();
  event.seconds = parts_.clock.now() - state_.started;
  event.message = message;
  control_.watch(event);
}

double SendRun::rpm_seen() const {
  if (rules_.guarded) return state_.guard.report.rpm;
  const StatusReport& report = state_.status.report;
  return report.measured_rpm.value_or(report.spindle_rpm.value_or(0.0));
}

JobProgress SendRun::progress() const {
  const GuardReport& guard = state_.guard.report;
  JobProgress at;
  at.sent = tracker_.sent();
  at.acknowledged = tracker_.acknowledged();
  at.executed = tracker_.executed();
  at.byte = tracker_.offset();
  at.state = state_name(state_.status.report.state);
  at.position = state_.status.position;
  at.spindle = rules_.guarded ? spindle_state_name(guard.spindle) : "as reported";
  at.rpm = rpm_seen();
  return at;
}

// How a run ends.

constexpr double kHoldAgain = 2.0;   ///< A ! that got lost is sent again after this, s.
constexpr double kBannerWait = 3.0;  ///< Wait for the banner after a reset, s.
constexpr double kReadWait = 0.05;   ///< Longest wait without a look at the second stop token, s.

std::string word_for(SendStatus status) {
  return status == SendStatus::kDone          ? "done"
         : status == SendStatus::kInterrupted ? "interrupted"
                                              : "fault";
}

/// From here on nothing more of the program is sent. The feed hold comes first; lines received but
/// not begun stay in the controller.
SendResult SendRun::stop_for(StopCause cause, std::string reason) {
  parts_.wire.discard();
  try {
    if (cause != StopCause::kLinkLost) {
      hold(cause, reason);
      if (cause == StopCause::kInterrupted) reset();
    } else {
      tell(SendEventKind::kStop, reason);
    }
  } catch (const LinkLost& lost) {
    reason += "; then " + std::string(lost.what());
  }
  const bool asked = cause == StopCause::kInterrupted;
  return end(asked ? SendStatus::kInterrupted : SendStatus::kFault, cause, std::move(reason));
}

void SendRun::hold(StopCause cause, const std::string& reason) {
  const bool interrupted = cause == StopCause::kInterrupted;
  const auto reset_now = [&] { return interrupted && control_.reset.stop_requested(); };
  const double end = parts_.clock.now() + rules_.options.hold_timeout;
  double hold_due = parts_.clock.now();
  double status_due = parts_.clock.now();
  state_.at_rest = false;
  bool told = false;
  while (!state_.at_rest && !reset_now() && parts_.clock.now() < end) {
    const double now = parts_.clock.now();
    if (now >= hold_due) {
      parts_.wire.urgent(realtime::kFeedHold);
      hold_due = now + kHoldAgain;
    }
    if (now >= status_due) {
      parts_.wire.urgent(realtime::kStatusReport);
      status_due = now + kStatusPause;
    }
    parts_.wire.flush();
    if (!std::exchange(told, true)) tell(SendEventKind::kStop, reason);
    take_while_stopping(std::min(kReadWait, std::max(status_due - now, 0.0)));
  }
}

/// It stops a spindle that the controller drives; one driven from here goes with it.
void SendRun::reset() {
  parts_.wire.urgent(realtime::kSoftReset);
  if (parts_.guard != nullptr) parts_.guard->stop();
  const double end = parts_.clock.now() + kBannerWait;
  for (bool greeted = false; !greeted && parts_.clock.now() < end;) {
    parts_.wire.flush();
    greeted = take_while_stopping(kReadWait);
    if (parts_.guard != nullptr) parts_.guard->poll();
  }
}

bool SendRun::take_while_stopping(double wait) {
  bool greeted = false;
  parts_.wire.receive(wait, [&](const Reply& reply) {
    greeted = greeted || reply.kind == Reply::Kind::kBanner;
    if (!reply.status) return;
    state_ = send_step::reported_while_stopping(std::move(state_), *reply.status, rules_.info);
    tracker_.report(*reply.status, state_.at_rest, parts_.clock.now());
  });
  return greeted;
}

SendResult SendRun::end(SendStatus status, StopCause cause, std::string reason) {
  SendResult result;
  result.status = status;
  result.cause = cause;
  result.reason = std::move(reason);
  result.sent = tracker_.sent();
  result.acknowledged = tracker_.acknowledged();
  result.executed = tracker_.executed();
  result.at_rest = state_.at_rest || status == SendStatus::kDone;
  result.seconds = parts_.clock.now() - state_.started;
  if (parts_.journal == nullptr) return result;
  try {
    parts_.journal->end(word_for(status), result.reason, progress());
  } catch (const JournalFailed& failed) {
    if (cause == StopCause::kJournal) return result;
    result.reason += "; and " + std::string(failed.what());
    if (!result.done()) return result;
    result.status = SendStatus::kFault;
    result.cause = StopCause::kJournal;
  }
  return result;
}

}  // namespace

SendResult Sender::run(ProgramFeed& feed, const SendControl& control) {
  const SendRules rules{info_, options_, parts_.guard != nullptr};
  return SendRun(parts_, rules, first_line_, feed, control).run();
}

}  // namespace lensforge
