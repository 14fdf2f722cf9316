// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/buffer_audit.h"

namespace lensforge {
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
