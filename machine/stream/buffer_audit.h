// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "machine/stream/line_tracker.h"
#include "machine/stream/status_report.h"

namespace lensforge {

/// Sets the bytes that a controller says it holds (Bf:) against those that are not answered yet.
/// Replies and reports come in one order, so a controller can never hold more than that, and what
/// was handed over a while ago it must hold, but for the line it works on. A reply that came twice
/// or not at all shows so before the stream next comes to rest.
class BufferAudit {
 public:
  /// @param rx_bytes  size of the receive buffer.
  explicit BufferAudit(int rx_bytes) : rx_bytes_(rx_bytes) {}

  /// Why the counts do not match, or empty. @param now  s of the sender's clock.
  std::string check(const StatusReport& report, const LineTracker& tracker, double now);

 private:
  int rx_bytes_;
  int missing_ = 0;  ///< Reports in a row in which bytes were missing.
};

}  // namespace lensforge
