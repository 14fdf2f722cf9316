// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/guard.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/reply_parser.h"
#include "machine/stream/sender.h"

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

/// Phase of a job.
enum class SendPhase {
  kStreaming,
  kAnswer,   ///< A barrier line is in transit.
  kSpindle,  ///< It was answered; the spindle is being verified.
  kEnding,   ///< Everything has been sent.
  kDone,
};

/// A hold that is not in the program.
struct HoldState {
  bool held = false;
  bool by_operator = false;  ///< Requested by the operator here.
  double since = 0.0;        ///< s
};

/// Commanded spindle state and its verification.
struct SpindleCheck {
  SpindleOrder order;
  bool verified = true;
  double since = 0.0;  ///< When the order was acknowledged, s.
};

/// The controller's reports and the times of the requests.
struct StatusWatch {
  StatusReport report;
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  int idle_reports = 0;  ///< In a row, requested after the last line was sent or answered.
  bool stale = false;    ///< The pending report was requested before a line was sent or answered.
  double due = 0.0;      ///< Time of the next ?, s.
  std::optional<double> asked_since;  ///< Time of the unanswered ?, s.
};

/// The guard's reports and polling times.
struct GuardWatch {
  GuardReport report;
  double due = 0.0;    ///< s
  bool ready = false;  ///< Every interlock was read and ok.
};

/// State of a running job, except the lines in transit (LineTracker). Times in s of the clock.
struct SendState {
  SendPhase phase = SendPhase::kStreaming;
  OutgoingLine barrier;  ///< The line of kAnswer and kSpindle.
  HoldState hold;
  SpindleCheck spindle;
  StatusWatch status;
  GuardWatch guard;
  double started = 0.0;
  double progress_at = 0.0;  ///< Time of the last reply or motion.
  bool at_rest = false;      ///< During a stop: nothing moves.
};

/// Result of a step: the next state, notes for operator and journal, and a fault if the stream must
/// stop. `notes` are reported before the stop.
struct SendStep {
  SendState state;
  std::vector<std::string> notes;
  std::optional<StreamFault> fault;
};

/// Constant inputs of all steps.
struct SendRules {
  const ControllerInfo& info;
  const SenderOptions& options;
  bool guarded = false;  ///< A guard verifies the spindle, not the controller's own report.
};

/// The decisions of a Sender as pure functions: none reads a clock, waits, or uses link, guard,
/// journal or operator. `now` in s. @pre `state` comes from the last step
namespace send_step {

/// True if lines may be sent at all.
bool may_send(const SendState& state, const SendRules& rules);
/// True if everything sent is answered and executed.
bool drained(const SendState& state, const LineTracker& tracker);
/// True if the controller has room for a line. @param waiting  bytes that the link has not taken
/// yet.
bool has_room(const OutgoingLine& line, const LineTracker& tracker, const SendRules& rules,
              bool waiting);
/// Fault if a line must not be sent: it cuts and the spindle is not verified.
std::optional<StreamFault> cut_fault(const SendState& state, const OutgoingLine& line,
                                     const SendRules& rules);
/// A line is sent. @param first  nothing else is in transit.
SendState handed_over(SendState state, const OutgoingLine& line, bool first, double now);

/// A line was answered. @param last  nothing else is in transit.
SendState acknowledged(SendState state, bool last, double now);
/// True if the answer completes a barrier: everything sent is executed.
bool passes_barrier(const SendState& state, bool last);

/// Decides whether to ask for a report now; if so, the returned state counts the request.
struct Question {
  SendState state;
  bool ask = false;
  std::optional<StreamFault> fault;  ///< The last request was not answered.
};
Question ask_status(SendState state, const SenderOptions& options, double now);
/// Takes a report: position, motion, overrides; checks the controller's state.
SendStep reported(SendState state, const StatusReport& report, const SendRules& rules, double now);
/// Counts the report if the controller is idle with nothing planned.
SendState count_idle(SendState state, const ControllerInfo& info);

/// Checks the guard's latest report: interlocks, and the running spindle.
SendStep guarded(SendState state, const SenderOptions& options, double now);
/// In kSpindle: continues once the spindle follows its command.
SendStep verify_spindle(SendState state, const SendRules& rules, double now);
/// Fault if there is neither a reply nor motion for too long.
SendStep watch_for_stall(SendState state, const LineTracker& tracker, const SenderOptions& options,
                         double now);

/// Handles a reply that is neither an ok nor a report: a note, a fault, or nothing.
SendStep other_reply(SendState state, const Reply& reply, std::int64_t oldest_line);
/// During a stop only the machine's motion counts. Replies are no longer matched to lines: that
/// match may itself be the fault.
SendState reported_while_stopping(SendState state, const StatusReport& report,
                                  const ControllerInfo& info);

/// Time to wait for bytes, s. @param waiting  bytes that the link has not taken yet.
double wait_time(const SendState& state, bool guarded, bool waiting, double now);

}  // namespace send_step

}  // namespace lensforge
