// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "machine/stream/program_feed.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

/// Options for interpreting a controller's reports.
struct TrackerOptions {
  std::int64_t first_line = 1;  ///< Every line before it counts as executed.
  int planner_blocks = 15;      ///< Maximum number of motions in the controller.
  double block_travel = 0.0;    ///< Axis travel from which a motion surely is a planner block, mm.
  std::int64_t largest_number = 9'999'999;  ///< Largest N word.
};

/// Tracks which lines are sent, acknowledged and executed.
///
/// If the controller reports Ln:, every line before that motion is executed, except those in the
/// step buffer: up to kStepLag lines while it moves, none at rest. Otherwise only the last
/// planner_blocks + 1 + kStepLag acknowledged lines that surely were motions may still be pending.
/// Either result counts only after kTrust: by then a lost or garbled line has shown in replies or
/// buffers. At rest with everything answered it counts at once.
class LineTracker {
 public:
  /// Maximum number of lines by which Ln: is ahead of the cutter: the step buffer of Grbl holds 6
  /// segments, that of grblHAL 10, each part of a single motion.
  static constexpr std::int64_t kStepLag = 10;
  /// s
  static constexpr double kTrust = 2.0;

  explicit LineTracker(const TrackerOptions& options);

  /// A line is sent at `now`.
  void send(const OutgoingLine& line, double now);
  /// The controller acknowledged the oldest line in transit. @pre !empty()
  void acknowledge();
  /// A status report arrived at `now`. @param at_rest  the machine is at rest.
  void report(const StatusReport& report, bool at_rest, double now);
  /// All acknowledged lines are executed.
  void all_done();

  [[nodiscard]] bool empty() const { return flying_.empty(); }
  [[nodiscard]] std::size_t count() const { return flying_.size(); }
  /// Number of bytes in transit, including line ends.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// The part of bytes() sent before `time`, and the length of the oldest line.
  [[nodiscard]] std::size_t bytes_before(double time) const;
  [[nodiscard]] std::size_t oldest_bytes() const;
  /// The line to be answered next, 0 for none.
  [[nodiscard]] std::int64_t oldest_line() const;
  /// Total dwell in transit, s.
  [[nodiscard]] double dwell() const { return dwell_; }
  /// True if a line that must be alone is in transit.
  [[nodiscard]] bool alone() const { return !flying_.empty() && flying_.back().alone; }

  [[nodiscard]] std::int64_t sent() const { return sent_; }
  [[nodiscard]] std::int64_t acknowledged() const { return acknowledged_; }
  [[nodiscard]] std::int64_t executed() const { return executed_; }
  [[nodiscard]] std::int64_t offset() const { return offset_; }

 private:
  struct Flying {
    std::int64_t line;
    std::int64_t next_offset;
    std::size_t bytes;
    double dwell;
    double travel;
    double sent_at;
    bool alone;
  };

  /// An executed line as reported, not trusted yet.
  struct Known {
    double time;
    std::int64_t line;
  };

  void note_known(std::int64_t line);

  TrackerOptions options_;
  std::deque<Flying> flying_;
  std::deque<std::int64_t> waiting_;  ///< Acknowledged motions that may be in the planner.
  std::size_t bytes_ = 0;
  double dwell_ = 0.0;
  std::int64_t sent_;
  std::int64_t acknowledged_;
  std::int64_t known_;           ///< Last executed line according to reports.
  std::deque<Known> untrusted_;  ///< known_ at the reports of the last kTrust seconds.
  std::int64_t executed_;
  std::int64_t offset_ = 0;
};

/// Compares the bytes in the controller's buffer (Bf:) with the bytes not answered yet. Replies and
/// reports arrive in order; the controller can never hold more than these, and it must hold those
/// sent a while ago, except the line it is processing. This reveals a duplicated or missing reply
/// before the stream next comes to rest.
class BufferAudit {
 public:
  /// @param rx_bytes  size of the receive buffer.
  explicit BufferAudit(int rx_bytes) : rx_bytes_(rx_bytes) {}

  /// The mismatch of the counts; empty if none. @param now  the sender's clock, s.
  std::string check(const StatusReport& report, const LineTracker& tracker, double now);

 private:
  int rx_bytes_;
  int missing_ = 0;  ///< Consecutive reports with missing bytes.
};

}  // namespace lensforge
