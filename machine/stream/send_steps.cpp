// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/send_steps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/text/words.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

LineTracker::LineTracker(const TrackerOptions& options)
    : options_(options),
      sent_(options.first_line - 1),
      acknowledged_(options.first_line - 1),
      known_(options.first_line - 1),
      executed_(options.first_line - 1) {}

void LineTracker::send(const OutgoingLine& line, double now) {
  const std::size_t bytes = line.text.size() + 1;
  flying_.push_back({line.line, line.next_offset, bytes, line.dwell, line.travel, now, line.alone});
  bytes_ += bytes;
  dwell_ += line.dwell;
  sent_ = std::max(sent_, line.line);
}

void LineTracker::acknowledge() {
  const Flying taken = flying_.front();
  flying_.pop_front();
  bytes_ -= taken.bytes;
  dwell_ = flying_.empty() ? 0.0 : dwell_ - taken.dwell;
  acknowledged_ = std::max(acknowledged_, taken.line);
  offset_ = std::max(offset_, taken.next_offset);
  if (taken.travel <= 0.0 || taken.travel < options_.block_travel) return;
  waiting_.push_back(taken.line);
  const auto kept = static_cast<std::size_t>(options_.planner_blocks + 1 + kStepLag);
  if (waiting_.size() <= kept) return;
  waiting_.pop_front();
  note_known(waiting_.front() - 1);
}

void LineTracker::report(const StatusReport& report, bool at_rest, double now) {
  if (report.line && *report.line != 0) {
    // N words begin again after the largest; the motion is not newer than the last line taken.
    const std::int64_t largest = options_.largest_number;
    const std::int64_t newest = ProgramFeed::number_of(std::max<std::int64_t>(sent_, 1), largest);
    const std::int64_t behind = (newest - *report.line % largest + largest) % largest;
    note_known(sent_ - behind - 1 - (at_rest ? 0 : kStepLag));
  }
  untrusted_.push_back({now, known_});
  while (untrusted_.front().time <= now - kTrust) {
    executed_ = std::max(executed_, untrusted_.front().line);
    untrusted_.pop_front();
  }
}

void LineTracker::all_done() {
  waiting_.clear();
  untrusted_.clear();
  known_ = executed_ = std::max(executed_, acknowledged_);
}

/// A refused line is not executed even if later ones are: after an error Grbl continues with the
/// lines it has received.
void LineTracker::note_known(std::int64_t line) {
  known_ = std::max(known_, std::min(line, acknowledged_));
}

std::size_t LineTracker::bytes_before(double time) const {
  std::size_t bytes = 0;
  for (const Flying& line : flying_) {
    if (line.sent_at >= time) break;
    bytes += line.bytes;
  }
  return bytes;
}

std::size_t LineTracker::oldest_bytes() const {
  return flying_.empty() ? 0 : flying_.front().bytes;
}

std::int64_t LineTracker::oldest_line() const { return flying_.empty() ? 0 : flying_.front().line; }

namespace {

/// Time after which bytes have certainly arrived: 1 kB takes 0.09 s at 115,200 baud.
constexpr double kTransit = 0.5;

/// Reports in a row that must agree before missing bytes count: a line may be between the receive
/// buffer and the parser.
constexpr int kReportsInARow = 3;

}  // namespace

std::string BufferAudit::check(const StatusReport& report, const LineTracker& tracker, double now) {
  if (!report.room) return {};
  const long held = static_cast<long>(rx_bytes_) - report.room->bytes;
  const auto unanswered = static_cast<long>(tracker.bytes());
  if (held > unanswered) {
    return "the controller holds " + std::to_string(held) + " bytes, but only " +
           std::to_string(unanswered) + " are not answered yet: a reply came twice";
  }
  const auto old = static_cast<long>(tracker.bytes_before(now - kTransit));
  const bool missing = old > 0 && held < old - static_cast<long>(tracker.oldest_bytes());
  missing_ = missing ? missing_ + 1 : 0;
  if (missing_ < kReportsInARow) return {};
  return "the controller holds " + std::to_string(held) + " bytes, but " + std::to_string(old) +
         " were handed over a while ago and are not answered: a reply is missing";
}

namespace {

/// A link that takes nothing is tried again after this, s.
constexpr double kWriteAgain = 0.002;
/// Longest time without a look at the stop token and the keys, s.
constexpr double kOperatorCheck = 0.1;
/// Grbl reports "Idle" between accepting a motion and starting it, hence more than one.
constexpr int kIdleReports = 2;
/// A ? that got lost is asked again after this, s.
constexpr double kStatusAgain = 1.0;
/// Tolerance of the controller's own speed report, which is rounded to whole rpm.
constexpr double kSpeedTolerance = 0.01;
/// Tolerance of an encoder's reading, share of the requested speed, and its reading at rest.
constexpr double kMeasuredTolerance = 0.05;
constexpr double kAtRestRpm = 10.0;
/// A position that differs by more is motion, mm.
constexpr double kMotion = 1e-4;
constexpr double kPercent = 0.01;

SendStep fault(SendState state, StopCause cause, const std::string& reason) {
  return {std::move(state), {}, StreamFault(cause, reason)};
}

std::string line_words(std::int64_t line) {
  return line > 0 ? "line " + std::to_string(line) : "no line";
}

/// The spindle's verification by the controller's report, without a guard. Empty: the report has
/// too little information.
std::optional<bool> reported_spindle(const StatusReport& report, const SpindleOrder& order) {
  const double share = report.overrides ? kPercent * report.overrides->z() : 1.0;
  const double wanted = order.turning() ? order.rpm * share : 0.0;
  if (report.measured_rpm) {
    return std::abs(*report.measured_rpm - wanted) <= kMeasuredTolerance * wanted + kAtRestRpm;
  }
  if (report.spindle_rpm) {
    return std::abs(*report.spindle_rpm - wanted) <= kSpeedTolerance * wanted + 1.0;
  }
  if (report.accessories) {
    return (report.accessories->find_first_of("SC") != std::string::npos) == order.turning();
  }
  return std::nullopt;
}

std::optional<bool> spindle_as_asked(const SendState& state, bool guarded) {
  const SpindleOrder& order = state.spindle.order;
  if (!guarded) return reported_spindle(state.status.report, order);
  return state.guard.report.spindle ==
         (order.turning() ? SpindleState::kAtSpeed : SpindleState::kStopped);
}

/// The program itself asks for a hold (M0), or for a tool.
bool waits_for_operator(const SendState& state) {
  return state.phase == SendPhase::kAnswer && (state.barrier.pauses || state.barrier.tool_change);
}

/// Controllers report overrides only at intervals. @return a note of the change, or empty
std::string take_overrides(const Eigen::Vector3i& before, StatusReport& report) {
  if (!report.overrides) report.overrides = before;
  const Eigen::Vector3i& now = *report.overrides;
  if (now == before) return {};
  return "overrides: feed " + std::to_string(now.x()) + " %, rapids " + std::to_string(now.y()) +
         " %, spindle " + std::to_string(now.z()) + " %";
}

SendStep go_on(SendStep step, double now) {
  HoldState& hold = step.state.hold;
  if (!hold.held) return step;
  hold.held = false;
  step.notes.push_back("goes on after a hold of " + std::to_string(std::lround(now - hold.since)) +
                       " s");
  return step;
}

SendStep held(SendStep step, double hold_limit, double now) {
  if (step.state.phase == SendPhase::kAnswer && step.state.barrier.pauses) return step;
  HoldState& hold = step.state.hold;
  if (!hold.held) {
    hold.since = now;
    step.notes.emplace_back(hold.by_operator ? "held by the operator" : "held from outside");
  }
  hold.held = true;
  if (hold_limit > 0.0 && now - hold.since > hold_limit) {
    step.fault.emplace(StopCause::kHeld, "held for longer than allowed");
  }
  return step;
}

/// Compares the controller's state with the expected one.
SendStep judge(SendStep step, double hold_limit, double now) {
  const StatusReport& report = step.state.status.report;
  switch (report.state) {
    case ReportedState::kIdle:
    case ReportedState::kRun:
      return go_on(std::move(step), now);
    case ReportedState::kHold:
      return held(std::move(step), hold_limit, now);
    case ReportedState::kTool:
      if (step.state.phase == SendPhase::kAnswer && step.state.barrier.tool_change) return step;
      break;
    case ReportedState::kAlarm:
      step.fault.emplace(StopCause::kAlarm, report.sub_state.value_or(0) > 0
                                                ? explain_alarm(*report.sub_state)
                                                : "the controller is in alarm");
      return step;
    case ReportedState::kDoor:
      step.fault.emplace(StopCause::kDoor, "the controller reports its safety door open");
      return step;
    default:
      break;
  }
  step.fault.emplace(StopCause::kUnexpectedState,
                     "the controller is in state " + std::string(state_name(report.state)));
  return step;
}

}  // namespace

namespace send_step {

bool may_send(const SendState& state, const SendRules& rules) {
  return state.phase == SendPhase::kStreaming && !state.hold.held &&
         (!rules.guarded || state.guard.ready);
}

bool drained(const SendState& state, const LineTracker& tracker) {
  return tracker.empty() && state.status.idle_reports >= kIdleReports;
}

bool has_room(const OutgoingLine& line, const LineTracker& tracker, const SendRules& rules,
              bool waiting) {
  if (tracker.empty()) return !waiting;
  if (!rules.options.character_counting || line.alone || tracker.alone()) return false;
  const std::size_t bytes = tracker.bytes() + line.text.size() + 1;
  return bytes <= static_cast<std::size_t>(rules.info.rx_bytes);
}

std::optional<StreamFault> cut_fault(const SendState& state, const OutgoingLine& line,
                                     const SendRules& rules) {
  const SpindleCheck& spindle = state.spindle;
  const bool by_hand = rules.info.dialect.spindle_by_hand && !spindle.order.turning();
  if (!line.cuts || by_hand || (spindle.order.turning() && spindle.verified)) return std::nullopt;
  return StreamFault(StopCause::kSpindle,
                     "line " + std::to_string(line.line) +
                         " moves at feed, but the spindle is not verified to turn");
}

SendState handed_over(SendState state, const OutgoingLine& line, bool first, double now) {
  if (line.barrier) {
    state.barrier = line;
    state.phase = SendPhase::kAnswer;
    if (line.spindle) {
      state.spindle.order = *line.spindle;
      state.spindle.verified = false;
    }
  }
  // Time during which there was nothing to wait for is no stall.
  if (first) state.progress_at = now;
  state.status.idle_reports = 0;
  state.status.stale = true;
  return state;
}

bool passes_barrier(const SendState& state, bool last) {
  return state.phase == SendPhase::kAnswer && last;
}

SendState acknowledged(SendState state, bool last, double now) {
  state.progress_at = now;
  state.status.idle_reports = 0;
  state.status.stale = true;
  if (!passes_barrier(state, last)) return state;
  const OutgoingLine& barrier = state.barrier;
  state.phase = barrier.ends      ? SendPhase::kEnding
                : barrier.spindle ? SendPhase::kSpindle
                                  : SendPhase::kStreaming;
  if (barrier.spindle) state.spindle.since = now;
  return state;
}

Question ask_status(SendState state, const SenderOptions& options, double now) {
  StatusWatch& status = state.status;
  if (now < status.due) return {std::move(state), false, {}};
  if (status.asked_since && now - *status.asked_since > options.reply_timeout) {
    const int silent = static_cast<int>(now - *status.asked_since);
    return {std::move(state), false,
            StreamFault(StopCause::kStall,
                        "the controller has not answered ? for " + std::to_string(silent) + " s")};
  }
  status.due =
      now + (status.asked_since ? kStatusAgain : std::max(options.status_interval, kStatusPause));
  if (!status.asked_since) {
    status.asked_since = now;
    status.stale = false;
  }
  return {std::move(state), true, {}};
}

SendStep reported(SendState state, const StatusReport& report, const SendRules& rules, double now) {
  StatusWatch& status = state.status;
  status.asked_since.reset();
  const std::optional<Eigen::Vector3d> position = rules.info.machine_position(report);
  const bool moved = position && status.position && (*position - *status.position).norm() > kMotion;
  if (moved || report.line != status.report.line) state.progress_at = now;
  const Eigen::Vector3i before = status.report.overrides.value_or(Eigen::Vector3i::Constant(100));
  status.report = report;
  status.position = position;
  const std::string changed = take_overrides(before, status.report);
  SendStep step{std::move(state), {}, {}};
  if (!changed.empty()) step.notes.push_back(changed);
  return judge(std::move(step), rules.options.hold_limit, now);
}

SendState count_idle(SendState state, const ControllerInfo& info) {
  StatusWatch& status = state.status;
  const std::optional<BufferRoom>& room = status.report.room;
  const bool idle =
      status.report.state == ReportedState::kIdle && (!room || room->blocks >= info.planner_blocks);
  status.idle_reports = idle && !status.stale ? status.idle_reports + 1 : 0;
  status.stale = false;
  return state;
}

SendStep guarded(SendState state, const SenderOptions& options, double now) {
  const GuardReport& found = state.guard.report;
  state.guard.ready = state.guard.ready || found.interlocks_ok;
  const bool may_be_unread = !state.guard.ready && now - state.started <= options.guard_timeout;
  if (!found.interlocks_ok && !may_be_unread) {
    const std::string reason = found.reason;
    return fault(std::move(state), StopCause::kInterlock, reason);
  }
  const SpindleCheck& spindle = state.spindle;
  const bool watched =
      spindle.order.turning() && state.phase != SendPhase::kSpindle && spindle.verified;
  if (!watched || found.spindle == SpindleState::kAtSpeed) return {std::move(state), {}, {}};
  const std::string reason = "the spindle lost its speed: " + found.reason + ", " +
                             std::to_string(static_cast<int>(found.rpm)) + " rpm read";
  return fault(std::move(state), StopCause::kSpindle, reason);
}

SendStep verify_spindle(SendState state, const SendRules& rules, double now) {
  if (rules.guarded && state.guard.report.spindle == SpindleState::kFailed) {
    const std::string reason = "the spindle failed: " + state.guard.report.reason;
    return fault(std::move(state), StopCause::kSpindle, reason);
  }
  const std::optional<bool> as_asked = spindle_as_asked(state, rules.guarded);
  if (as_asked.value_or(false)) {
    state.spindle.verified = true;
    state.phase = SendPhase::kStreaming;
    return {std::move(state), {}, {}};
  }
  if (now - state.spindle.since <= rules.options.spindle_timeout) {
    return {std::move(state), {}, {}};
  }
  const std::string rpm = std::to_string(std::lround(state.spindle.order.rpm));
  return fault(std::move(state), StopCause::kSpindle,
               as_asked ? "the spindle did not come to " + rpm + " rpm in time"
                        : "the controller does not report whether the spindle turns");
}

SendStep watch_for_stall(SendState state, const LineTracker& tracker, const SenderOptions& options,
                         double now) {
  if (state.hold.held || waits_for_operator(state) || tracker.empty()) {
    state.progress_at = now;
    return {std::move(state), {}, {}};
  }
  double allowed = options.progress_timeout + tracker.dwell();
  // Controllers may wait for the spindle before they answer.
  if (state.phase == SendPhase::kAnswer) allowed += options.spindle_timeout;
  if (now - state.progress_at <= allowed) return {std::move(state), {}, {}};
  const std::string line = line_words(tracker.oldest_line());
  if (state.status.report.state == ReportedState::kIdle) {
    return fault(std::move(state), StopCause::kCountMismatch,
                 "the controller is idle, but " + line + " was never answered");
  }
  return fault(std::move(state), StopCause::kStall, "no motion, and no answer to " + line);
}

SendStep other_reply(SendState state, const Reply& reply, std::int64_t oldest_line) {
  switch (reply.kind) {
    case Reply::Kind::kError:
      return fault(std::move(state), StopCause::kError,
                   line_words(oldest_line) + " was refused: " + explain_error(reply.code));
    case Reply::Kind::kAlarm:
      return fault(std::move(state), StopCause::kAlarm, explain_alarm(reply.code));
    case Reply::Kind::kBanner:
      return fault(std::move(state), StopCause::kReset,
                   "the controller started afresh: " + reply.text);
    case Reply::Kind::kMessage:
      return {std::move(state), {"controller: " + reply.value}, {}};
    case Reply::Kind::kEmpty:
      return {std::move(state), {}, {}};
    case Reply::Kind::kData:
      if (reply.name == "echo") return {std::move(state), {}, {}};
      break;
    default:
      break;
  }
  return fault(std::move(state), StopCause::kGarbledReply,
               "not a reply to anything: '" + printable_line(reply.text) + "'");
}

SendState reported_while_stopping(SendState state, const StatusReport& report,
                                  const ControllerInfo& info) {
  state.status.report = report;
  state.status.position = info.machine_position(report);
  state.at_rest = at_rest(report);
  return state;
}

double wait_time(const SendState& state, bool guarded, bool waiting, double now) {
  if (waiting) return kWriteAgain;
  double due = std::min(state.status.due, now + kOperatorCheck);
  if (guarded) due = std::min(due, state.guard.due);
  return std::max(due - now, 0.0);
}

}  // namespace send_step

}  // namespace lensforge
