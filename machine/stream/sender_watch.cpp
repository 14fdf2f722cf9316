// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "core/text/printable.h"
#include "machine/guard/spindle_state_name.h"
#include "machine/stream/controller_codes.h"
#include "machine/stream/sender.h"

namespace lensforge {
namespace {

/// How far the controller's own report of the speed may be off; it rounds to whole rpm.
constexpr double kSpeedTolerance = 0.01;
/// A position that differs by more is motion, mm.
constexpr double kMotion = 1e-4;
constexpr double kPercent = 0.01;

std::string line_words(std::int64_t line) {
  return line > 0 ? "line " + std::to_string(line) : "no line";
}

/// What a controller without a guard beside it tells of its spindle. Nothing: it tells too little.
std::optional<bool> reported_spindle(const StatusReport& report, const SpindleOrder& order) {
  const double share = report.overrides ? kPercent * report.overrides->z() : 1.0;
  if (report.spindle_rpm) {
    const double wanted = order.turning() ? order.rpm * share : 0.0;
    return std::abs(*report.spindle_rpm - wanted) <= kSpeedTolerance * wanted + 1.0;
  }
  if (report.accessories) {
    return (report.accessories->find_first_of("SC") != std::string::npos) == order.turning();
  }
  return std::nullopt;
}

}  // namespace

void Sender::take(const Reply& reply) {
  switch (reply.kind) {
    case Reply::Kind::kOk:
      return take_ok();
    case Reply::Kind::kStatus:
      return take_status(*reply.status);
    case Reply::Kind::kError:
      throw StreamFault(StopCause::kError, line_words(tracker_.oldest_line()) +
                                               " was refused: " + explain_error(reply.code));
    case Reply::Kind::kAlarm:
      throw StreamFault(StopCause::kAlarm, explain_alarm(reply.code));
    case Reply::Kind::kBanner:
      throw StreamFault(StopCause::kReset, "the controller started afresh: " + reply.text);
    case Reply::Kind::kMessage:
      note("controller: " + reply.value);
      return;
    case Reply::Kind::kEmpty:
      return;
    case Reply::Kind::kData:
      if (reply.name == "echo") return;
      break;
    default:
      break;
  }
  throw StreamFault(StopCause::kGarbledReply,
                    "not a reply to anything: '" + printable_line(reply.text) + "'");
}

void Sender::take_ok() {
  if (tracker_.empty()) {
    throw StreamFault(StopCause::kCountMismatch, "an ok came, but no line waits for one");
  }
  tracker_.acknowledge();
  progress_at_ = clock_.now();
  idle_reports_ = 0;
  stale_ = true;
  if (phase_ == Phase::kAnswer && tracker_.empty()) pass_barrier();
}

void Sender::pass_barrier() {
  tracker_.all_done();
  phase_ = barrier_.ends ? Phase::kEnding : Phase::kStreaming;
  if (!barrier_.spindle) return;
  spindle_since_ = clock_.now();
  if (!barrier_.ends) phase_ = Phase::kSpindle;
}

void Sender::verify_spindle() {
  std::optional<bool> as_asked;
  if (guard_ != nullptr) {
    const bool failed = guarded_.spindle == SpindleState::kFailed;
    if (failed) throw StreamFault(StopCause::kSpindle, "the spindle failed: " + guarded_.reason);
    as_asked =
        guarded_.spindle == (spindle_.turning() ? SpindleState::kAtSpeed : SpindleState::kStopped);
  } else {
    as_asked = reported_spindle(report_, spindle_);
  }
  if (as_asked.value_or(false)) {
    verified_ = true;
    phase_ = Phase::kStreaming;
    return;
  }
  if (clock_.now() - spindle_since_ <= options_.spindle_timeout) return;
  throw StreamFault(StopCause::kSpindle,
                    as_asked ? "the spindle did not come to " +
                                   std::to_string(std::lround(spindle_.rpm)) + " rpm in time"
                             : "the controller does not tell whether the spindle turns");
}

void Sender::take_status(const StatusReport& report) {
  asked_since_.reset();
  const std::optional<Eigen::Vector3d> position = info_.machine_position(report);
  const bool moved = position && position_ && (*position - *position_).norm() > kMotion;
  if (moved || report.line != report_.line) progress_at_ = clock_.now();
  take_overrides(report);
  position_ = position;
  judge_state(report);
  tracker_.report(report, lensforge::at_rest(report), clock_.now());
  const bool idle = report.state == ReportedState::kIdle &&
                    (!report.room || report.room->blocks >= info_.planner_blocks);
  idle_reports_ = idle && !stale_ ? idle_reports_ + 1 : 0;
  stale_ = false;
  if (options_.character_counting) {
    const std::string mismatch = audit_.check(report, tracker_, clock_.now());
    if (!mismatch.empty()) throw StreamFault(StopCause::kCountMismatch, mismatch);
  }
  if (drained()) tracker_.all_done();
  if (guard_ == nullptr && phase_ == Phase::kSpindle) verify_spindle();
  if (journal_ != nullptr) journal_->progress(progress());
  tell(SendEventKind::kStatus, {});
}

/// Controllers tell overrides now and then only.
void Sender::take_overrides(const StatusReport& report) {
  const Eigen::Vector3i before = report_.overrides.value_or(Eigen::Vector3i::Constant(100));
  report_ = report;
  if (!report_.overrides) report_.overrides = before;
  const Eigen::Vector3i& now = *report_.overrides;
  if (now == before) return;
  note("overrides: feed " + std::to_string(now.x()) + " %, rapids " + std::to_string(now.y()) +
       " %, spindle " + std::to_string(now.z()) + " %");
}

void Sender::judge_state(const StatusReport& report) {
  switch (report.state) {
    case ReportedState::kIdle:
    case ReportedState::kRun:
      return go_on();
    case ReportedState::kTool:
      if (phase_ == Phase::kAnswer && barrier_.tool_change) return;
      break;
    case ReportedState::kHold:
      if (phase_ == Phase::kAnswer && barrier_.pauses) return;
      if (!held_) {
        held_since_ = clock_.now();
        note(held_by_operator_ ? "held by the operator" : "held from outside");
      }
      held_ = true;
      if (options_.hold_limit > 0.0 && clock_.now() - held_since_ > options_.hold_limit) {
        throw StreamFault(StopCause::kHeld, "held for longer than allowed");
      }
      return;
    case ReportedState::kAlarm:
      throw StreamFault(StopCause::kAlarm, report.sub_state.value_or(0) > 0
                                               ? explain_alarm(*report.sub_state)
                                               : "the controller is in alarm");
    case ReportedState::kDoor:
      throw StreamFault(StopCause::kDoor, "the controller reports its safety door open");
    default:
      break;
  }
  throw StreamFault(StopCause::kUnexpectedState,
                    "the controller is in state " + std::string(state_name(report.state)));
}

void Sender::go_on() {
  if (!held_) return;
  held_ = false;
  note("goes on after a hold of " + std::to_string(std::lround(clock_.now() - held_since_)) + " s");
}

void Sender::watch_for_stall() {
  const bool waits_for_somebody =
      held_ || (phase_ == Phase::kAnswer && (barrier_.pauses || barrier_.tool_change));
  if (waits_for_somebody || tracker_.empty()) {
    progress_at_ = clock_.now();
    return;
  }
  double allowed = options_.progress_timeout + tracker_.dwell();
  // Controllers may wait for the spindle before they answer.
  if (phase_ == Phase::kAnswer) allowed += options_.spindle_timeout;
  if (clock_.now() - progress_at_ <= allowed) return;
  const std::string line = line_words(tracker_.oldest_line());
  if (report_.state == ReportedState::kIdle) {
    throw StreamFault(StopCause::kCountMismatch,
                      "the controller is idle, but " + line + " was never answered");
  }
  throw StreamFault(StopCause::kStall, "no motion, and no answer to " + line);
}

void Sender::note(const std::string& text) {
  if (journal_ != nullptr) journal_->note(tracker_.executed(), text);
  tell(SendEventKind::kNote, text);
}

void Sender::tell(SendEventKind kind, const std::string& message) {
  if (!control_->watch) return;
  SendEvent event;
  event.kind = kind;
  event.report = report_;
  event.position = position_;
  event.sent = tracker_.sent();
  event.acknowledged = tracker_.acknowledged();
  event.executed = tracker_.executed();
  event.byte = tracker_.offset();
  event.rpm_asked = spindle_.turning() ? spindle_.rpm : 0.0;
  event.rpm_measured = guard_ != nullptr ? guarded_.rpm : report_.spindle_rpm.value_or(0.0);
  event.seconds = clock_.now() - started_;
  event.message = message;
  control_->watch(event);
}

JobProgress Sender::progress() const {
  JobProgress at;
  at.sent = tracker_.sent();
  at.acknowledged = tracker_.acknowledged();
  at.executed = tracker_.executed();
  at.byte = tracker_.offset();
  at.state = state_name(report_.state);
  at.position = position_;
  at.spindle = guard_ != nullptr ? spindle_state_name(guarded_.spindle) : "as reported";
  at.rpm = guard_ != nullptr ? guarded_.rpm : report_.spindle_rpm.value_or(0.0);
  return at;
}

}  // namespace lensforge
