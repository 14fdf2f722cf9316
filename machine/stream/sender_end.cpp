// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include "machine/stream/realtime.h"
#include "machine/stream/sender.h"

namespace lensforge {
namespace {

constexpr double kStatusPause = 0.2;  ///< Five ? a second.
constexpr double kHoldAgain = 2.0;    ///< A ! that got lost is sent again after this, s.
constexpr double kBannerWait = 3.0;   ///< For the banner after a reset, s.
constexpr double kReadWait = 0.05;    ///< Longest wait without a look at the second stop token, s.

}  // namespace

/// Nothing more of the program leaves from here on. The feed hold comes before all else; what the
/// controller has received but not begun stays where it is.
SendResult Sender::stop_for(StopCause cause, std::string reason) {
  wire_.discard();
  try {
    if (cause != StopCause::kLinkLost) {
      hold(cause, reason);
    } else {
      tell(SendEventKind::kStop, reason);
    }
  } catch (const LinkLost& lost) {
    reason += "; then " + std::string(lost.what());
  }
  const bool asked = cause == StopCause::kInterrupted;
  return end(asked ? SendStatus::kInterrupted : SendStatus::kFault, cause, std::move(reason));
}

void Sender::hold(StopCause cause, const std::string& reason) {
  const bool interrupted = cause == StopCause::kInterrupted;
  const auto reset_now = [&] { return interrupted && control_->reset.stop_requested(); };
  const double end = clock_.now() + options_.hold_timeout;
  double hold_due = clock_.now();
  double status_due = clock_.now();
  at_rest_ = false;
  bool told = false;
  while (!at_rest_ && !reset_now() && clock_.now() < end) {
    const double now = clock_.now();
    if (now >= hold_due) {
      wire_.urgent(realtime::kFeedHold);
      hold_due = now + kHoldAgain;
    }
    if (now >= status_due) {
      wire_.urgent(realtime::kStatusReport);
      status_due = now + kStatusPause;
    }
    wire_.flush();
    if (!told) tell(SendEventKind::kStop, reason);
    told = true;
    const double wait = std::min(kReadWait, std::max(status_due - now, 0.0));
    wire_.receive(wait, [this](const Reply& reply) { take_while_stopping(reply); });
  }
  if (!interrupted) return;
  wire_.urgent(realtime::kSoftReset);
  // The reset stops a spindle that the controller drives; one driven from here goes with it.
  if (guard_ != nullptr) guard_->stop();
  wait_for_banner();
}

/// From here on only what the machine does counts. Lines are not taken any more: which reply
/// belongs to which may be the very thing that is wrong.
void Sender::take_while_stopping(const Reply& reply) {
  if (reply.kind == Reply::Kind::kBanner) banner_seen_ = true;
  if (!reply.status) return;
  report_ = *reply.status;
  position_ = info_.machine_position(report_);
  at_rest_ = lensforge::at_rest(report_);
  tracker_.report(report_, at_rest_, clock_.now());
}

void Sender::wait_for_banner() {
  banner_seen_ = false;
  const double end = clock_.now() + kBannerWait;
  while (!banner_seen_ && clock_.now() < end) {
    wire_.flush();
    wire_.receive(kReadWait, [this](const Reply& reply) { take_while_stopping(reply); });
    if (guard_ != nullptr) guard_->poll();
  }
}

SendResult Sender::end(SendStatus status, StopCause cause, std::string reason) {
  SendResult result;
  result.status = status;
  result.cause = cause;
  result.reason = std::move(reason);
  result.sent = tracker_.sent();
  result.acknowledged = tracker_.acknowledged();
  result.executed = tracker_.executed();
  result.at_rest = at_rest_ || status == SendStatus::kDone;
  result.seconds = clock_.now() - started_;
  if (journal_ == nullptr) return result;
  try {
    const std::string word = result.done()                        ? "done"
                             : status == SendStatus::kInterrupted ? "interrupted"
                                                                  : "fault";
    journal_->end(word, result.reason, progress());
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
