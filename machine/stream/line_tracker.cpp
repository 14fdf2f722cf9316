// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/line_tracker.h"

#include <algorithm>

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

}  // namespace lensforge
