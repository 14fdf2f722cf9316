// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "core/error.h"
#include "core/text/printable.h"
#include "machine/stream/controller_codes.h"
#include "machine/stream/controller_info.h"
#include "machine/stream/realtime.h"

namespace lensforge {
namespace {

constexpr double kAskAgain = 0.5;          ///< Between two ? to a controller that is silent, s.
constexpr double kStatusPause = 0.2;       ///< Between two ? otherwise: five a second.
constexpr double kStopCheck = 0.1;         ///< Longest wait without a look at the stop token, s.
constexpr double kResetAgain = 1.5;        ///< A reset that got lost is sent again, s.
constexpr double kQuietAfterBanner = 0.3;  ///< Start-up lines and messages follow a banner, s.

using Kind = Reply::Kind;

[[noreturn]] void no_answer_to(const std::string& what) {
  throw StreamFault(StopCause::kStall, "the controller does not answer " + what);
}

/// "Grbl 0.9j ['$' for help]", or a report with commas: "<Idle,MPos:0.000,…,WPos:…>".
bool is_too_old(const Reply& reply) {
  if (reply.kind == Kind::kBanner) return reply.text.starts_with("Grbl 0.");
  return reply.kind == Kind::kUnknown && reply.text.starts_with('<') &&
         reply.text.find(",MPos:") != std::string::npos;
}

}  // namespace

bool at_rest(const StatusReport& report) {
  switch (report.state) {
    case ReportedState::kIdle:
    case ReportedState::kAlarm:
    case ReportedState::kCheck:
    case ReportedState::kSleep:
    case ReportedState::kTool:
      return true;
    case ReportedState::kHold:
      return report.sub_state.value_or(0) == 0;
    case ReportedState::kDoor:
      return report.sub_state.value_or(0) <= 1;
    default:
      return false;
  }
}

void Dialogue::pause_until_reply(double until) {
  if (stop_.stop_requested()) throw StreamFault(StopCause::kInterrupted, "interrupted");
  wire_.flush();
  const double wait = std::clamp(until - clock_.now(), 0.0, kStopCheck);
  wire_.receive(wait, [this](const Reply& reply) { take(reply); });
}

void Dialogue::take(const Reply& reply) {
  if (is_too_old(reply)) {
    throw InputError("the controller runs firmware older than Grbl 1.1 ('" +
                     printable_line(reply.text) +
                     "'), whose reports tell too little; load Grbl 1.1 or grblHAL onto its board");
  }
  replies_.push_back(reply);
}

std::optional<StatusReport> Dialogue::ask_status(double timeout) {
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    replies_.clear();
    wire_.urgent(realtime::kStatusReport);
    const double until = std::min(end, clock_.now() + kAskAgain);
    while (clock_.now() < until) {
      pause_until_reply(until);
      for (const Reply& reply : replies_) {
        if (reply.status) return reply.status;
      }
      replies_.clear();
    }
  }
  return std::nullopt;
}

void Dialogue::silence() { no_answer_to("?; is it switched on, is it the right port and speed?"); }

StatusReport Dialogue::status(double timeout) {
  const std::optional<StatusReport> report = ask_status(timeout);
  if (!report) no_answer_to("?");
  return *report;
}

std::vector<Reply> Dialogue::ask(const std::string& line, double timeout) {
  replies_.clear();
  wire_.line(line);
  std::vector<Reply> answer;
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    pause_until_reply(end);
    for (const Reply& reply : replies_) {
      if (reply.kind == Kind::kOk) return answer;
      if (reply.kind == Kind::kError) {
        throw StreamFault(StopCause::kError, line + " was refused: " + explain_error(reply.code));
      }
      if (reply.kind == Kind::kAlarm) {
        throw StreamFault(StopCause::kAlarm, line + ": " + explain_alarm(reply.code));
      }
      if (reply.kind == Kind::kUnknown) {
        throw StreamFault(StopCause::kGarbledReply,
                          line + ": '" + printable_line(reply.text) + "'");
      }
      answer.push_back(reply);
    }
    replies_.clear();
  }
  no_answer_to(line);
}

std::string Dialogue::reset(double timeout) {
  std::string banner = try_reset(timeout);
  if (banner.empty()) no_answer_to("a reset");
  return banner;
}

std::string Dialogue::try_reset(double timeout) {
  replies_.clear();
  wire_.discard();
  const double end = clock_.now() + timeout;
  std::string banner;
  double until = end;
  double again = clock_.now();
  while (clock_.now() < until) {
    if (banner.empty() && clock_.now() >= again) {
      wire_.urgent(realtime::kSoftReset);
      again = clock_.now() + kResetAgain;
    }
    pause_until_reply(until);
    for (const Reply& reply : replies_) {
      if (reply.kind != Kind::kBanner) continue;
      banner = reply.text;
      until = clock_.now() + kQuietAfterBanner;
    }
    replies_.clear();
  }
  return banner;
}

StatusReport Dialogue::hold(double timeout) {
  wire_.discard();
  wire_.urgent(realtime::kFeedHold);
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    StatusReport report = status();
    if (at_rest(report)) return report;
    pause_until_reply(clock_.now() + kStatusPause);
  }
  throw StreamFault(StopCause::kStall, "the machine does not stop in a feed hold");
}

}  // namespace lensforge
