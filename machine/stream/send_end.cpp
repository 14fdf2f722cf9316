// SPDX-License-Identifier: GPL-3.0-or-later
// How a run ends.
#include <algorithm>
#include <utility>

#include "machine/stream/realtime.h"
#include "machine/stream/send_run.h"

namespace lensforge {
namespace {

constexpr double kStatusPause = 0.2;  ///< Five ? a second.
constexpr double kHoldAgain = 2.0;    ///< A ! that got lost is sent again after this, s.
constexpr double kBannerWait = 3.0;   ///< For the banner after a reset, s.
constexpr double kReadWait = 0.05;    ///< Longest wait without a look at the second stop token, s.

std::string word_for(SendStatus status) {
  return status == SendStatus::kDone          ? "done"
         : status == SendStatus::kInterrupted ? "interrupted"
                                              : "fault";
}

}  // namespace

/// Nothing more of the program leaves from here on. The feed hold comes before all else; what the
/// controller has received but not begun stays where it is.
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

}  // namespace lensforge
