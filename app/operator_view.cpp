// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/operator_view.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "app/console.h"
#include "app/json_output.h"
#include "core/text/printable.h"

namespace lensforge::app {
namespace {

constexpr std::chrono::milliseconds kRedraw{150};
constexpr std::chrono::seconds kPlainLine{5};
constexpr int kBarWidth = 24;
/// The pace is trusted once so much was cut, share of the file and s.
constexpr double kPaceShare = 0.01;
constexpr double kPaceSeconds = 20.0;

std::string bar(double share) {
  const auto filled = static_cast<std::size_t>(share * kBarWidth);
  return std::string(filled, '#').append(kBarWidth - filled, '.');
}

std::string rounded(double value) { return fixed(value, 0); }

std::string progress_text(const SendEvent& event, const JobView& job, double left) {
  return rounded(std::floor(100.0 * share_of(event, job))) + " %  line " +
         std::to_string(event.acknowledged) + " of " + std::to_string(job.lines) + "  " +
         duration_text(event.seconds) + " gone, " + duration_text(left) + " left";
}

std::string machine_text(const SendEvent& event) {
  std::string text(state_name(event.report.state));
  if (event.position) text.append("  ").append(position_text(*event.position));
  if (event.report.feed) text += "  F" + rounded(*event.report.feed);
  text += "  S" + rounded(event.rpm_asked) + " asked, " + rounded(event.rpm_seen) +
          (event.rpm_is_measured ? " measured" : " reported");
  return text;
}

/// How full a buffer is: "12/15".
std::string level(int free, int size) {
  return size > 0 ? std::to_string(std::clamp(size - free, 0, size)) + "/" + std::to_string(size)
                  : std::to_string(free) + " free";
}

std::string buffer_text(const SendEvent& event, const JobView& job) {
  std::string text = "buffers ";
  if (const auto& room = event.report.room) {
    text += "planner " + level(room->blocks, job.planner_blocks) + ", receive " +
            level(room->bytes, job.rx_bytes);
  } else {
    text += "not reported";
  }
  const auto& share = event.report.overrides;
  if (share && *share != Eigen::Vector3i::Constant(100)) {
    text += "  overrides F" + std::to_string(share->x()) + " R" + std::to_string(share->y()) +
            " S" + std::to_string(share->z()) + " %";
  }
  if (!event.report.pins.empty()) text += "  inputs " + printable_line(event.report.pins);
  return text;
}

/// A reader of standard error that does not keep up must not keep the sender waiting: a pipe that
/// is ready takes more than any of these lines at once.
bool can_show() {
  pollfd entry{STDERR_FILENO, POLLOUT, 0};
  return ::poll(&entry, 1, 0) > 0;
}

}  // namespace

std::string position_text(const Eigen::Vector3d& at) {
  std::string text("X");
  text.append(fixed(at.x(), 2)).append(" Y").append(fixed(at.y(), 2));
  return text.append(" Z").append(fixed(at.z(), 3));
}

std::string duration_text(double seconds) {
  const long whole = std::lround(seconds);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60,
                whole % 60);
  return text.data();
}

double share_of(const SendEvent& event, const JobView& job) {
  if (job.bytes <= 0) return 0.0;
  const double share = static_cast<double>(event.byte) / static_cast<double>(job.bytes);
  return std::clamp(share, 0.0, 1.0);
}

void TimeLeft::take(const SendEvent& event) {
  if (event.report.state == ReportedState::kHold) held_ += event.seconds - last_;
  last_ = event.seconds;
  const double share = share_of(event, job_);
  left_ = job_.estimate * (1.0 - share);
  if (job_.bytes <= 0) return;
  const double begun = static_cast<double>(job_.first_byte) / static_cast<double>(job_.bytes);
  const double spent = event.seconds - held_;
  const double cut = share - begun;
  if (cut > kPaceShare && spent > kPaceSeconds) left_ = spent / cut * (1.0 - share);
}

std::vector<std::string> view_lines(const SendEvent& event, const JobView& job, double left,
                                    const std::string& warning) {
  std::vector<std::string> lines = {
      bar(share_of(event, job)) + "  " + progress_text(event, job, left), machine_text(event),
      buffer_text(event, job)};
  if (!warning.empty()) lines.back() += "  ! " + printable_line(warning);
  return lines;
}

OperatorView::OperatorView(bool quiet, const JobView& job)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), job_(job) {}

OperatorView::~OperatorView() {
  if (drawn_ > 0 && can_show()) std::fputs("\n", stderr);
}

void OperatorView::take(const SendEvent& event, double left) {
  if (quiet_ || event.kind == SendEventKind::kReading || !can_show()) return;
  if (!event.message.empty()) {
    note(event.message);
    warning_ = event.message;
  }
  const Clock::time_point now = Clock::now();
  const Clock::duration wait = terminal_ ? Clock::duration(kRedraw) : kPlainLine;
  if (event.message.empty() && now - shown_ < wait) return;
  if (terminal_) {
    shown_ = now;
    return show(view_lines(event, job_, left, warning_));
  }
  if (now - shown_ < wait) return;
  shown_ = now;
  const std::string line = progress_text(event, job_, left) + "  " + machine_text(event) + "  " +
                           buffer_text(event, job_);
  std::fprintf(stderr, "%s\n", line.c_str());
}

void OperatorView::note(const std::string& text) {
  wipe();
  const Console console(false, false);
  console.begin();
  console.note(text);
}

void OperatorView::show(const std::vector<std::string>& lines) {
  wipe();
  const std::size_t width = terminal_width() - 1;
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) text += "\n";
    text += lines[i].substr(0, width) + "\033[K";
  }
  std::fputs(text.c_str(), stderr);
  drawn_ = lines.size();
}

/// Back to where the lines begin, and nothing from there on.
void OperatorView::wipe() {
  if (drawn_ == 0) return;
  std::fputs("\r", stderr);
  if (drawn_ > 1) std::fprintf(stderr, "\033[%zuA", drawn_ - 1);
  std::fputs("\033[J", stderr);
  drawn_ = 0;
}

}  // namespace lensforge::app
