// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "machine/stream/program_feed.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

/// What decides how a controller's reports are read.
struct TrackerOptions {
  std::int64_t first_line = 1;  ///< Every line before it counts as carried out.
  int planner_blocks = 15;      ///< Motions that the controller holds at most.
  double block_travel = 0.0;    ///< A motion that moves an axis this far is a block for sure, mm.
  std::int64_t largest_number = 9'999'999;  ///< Of an N word.
};

/// Which lines are on their way, taken and carried out.
///
/// Where the controller reports Ln:, every line before that motion is carried out but for those
/// that lie cut into steps already: up to kStepLag lines while it moves, none once it stands.
/// Elsewhere the last planner_blocks + 1 + kStepLag taken lines that were motions for sure may
/// still be waiting, and nothing before them. Either counts only after kTrust: by then a line that
/// was lost or spoilt on its way has shown in replies or buffers. At a standstill with everything
/// answered it counts at once.
class LineTracker {
 public:
  /// Lines by which Ln: may run ahead of the cutter: the step buffer of Grbl holds 6 segments, that
  /// of grblHAL 10, each of one motion at least.
  static constexpr std::int64_t kStepLag = 10;
  /// s
  static constexpr double kTrust = 2.0;

  explicit LineTracker(const TrackerOptions& options);

  /// A line is handed over at `now`.
  void send(const OutgoingLine& line, double now);
  /// The controller took the oldest line on its way. @pre !empty()
  void acknowledge();
  /// The controller tells what it does at `now`. @param at_rest  it stands still.
  void report(const StatusReport& report, bool at_rest, double now);
  /// Everything that was taken is carried out.
  void all_done();

  [[nodiscard]] bool empty() const { return flying_.empty(); }
  [[nodiscard]] std::size_t count() const { return flying_.size(); }
  /// Bytes on their way, line ends included.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// The part of bytes() that was handed over before `time`, and the length of the oldest line.
  [[nodiscard]] std::size_t bytes_before(double time) const;
  [[nodiscard]] std::size_t oldest_bytes() const;
  /// The line that is to be answered next, 0 for none.
  [[nodiscard]] std::int64_t oldest_line() const;
  /// Dwells on their way, s.
  [[nodiscard]] double dwell() const { return dwell_; }
  /// Whether a line that must be alone is on its way.
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

  /// What is carried out as far as is known, not trusted yet.
  struct Known {
    double time;
    std::int64_t line;
  };

  void note_known(std::int64_t line);

  TrackerOptions options_;
  std::deque<Flying> flying_;
  std::deque<std::int64_t> waiting_;  ///< Taken motions that may lie in the planner.
  std::size_t bytes_ = 0;
  double dwell_ = 0.0;
  std::int64_t sent_;
  std::int64_t acknowledged_;
  std::int64_t known_;           ///< Carried out as it seems.
  std::deque<Known> untrusted_;  ///< known_ at the reports of the last kTrust seconds.
  std::int64_t executed_;
  std::int64_t offset_ = 0;
};

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
