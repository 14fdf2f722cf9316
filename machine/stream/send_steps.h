// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/guard.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/line_tracker.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/reply_parser.h"
#include "machine/stream/sender.h"

namespace lensforge {

/// Where a job is in its program.
enum class SendPhase {
  kStreaming,
  kAnswer,   ///< A barrier line is on its way.
  kSpindle,  ///< It was taken; the spindle is to be verified.
  kEnding,   ///< Nothing is left to send.
  kDone,
};

/// A hold that the program did not ask for.
struct HoldState {
  bool held = false;
  bool by_operator = false;  ///< The operator asked for it here.
  double since = 0.0;        ///< s
};

/// What the spindle is asked for, and whether it does so.
struct SpindleCheck {
  SpindleOrder order;
  bool verified = true;
  double since = 0.0;  ///< When the order was taken, s.
};

/// What the controller reports, and when it is asked.
struct StatusWatch {
  StatusReport report;
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  int idle_reports = 0;  ///< In a row, asked for after the last line was sent or taken.
  bool stale = false;    ///< The report under way was asked for before a line moved on.
  double due = 0.0;      ///< Next ?, s.
  std::optional<double> asked_since;  ///< A ? is unanswered, s.
};

/// What the guard reports, and when it is polled.
struct GuardWatch {
  GuardReport report;
  double due = 0.0;    ///< s
  bool ready = false;  ///< Every interlock was read and found as it should be.
};

/// A job in progress, but for the lines on their way (LineTracker). Times in s of the clock.
struct SendState {
  SendPhase phase = SendPhase::kStreaming;
  OutgoingLine barrier;  ///< Of kAnswer and kSpindle.
  HoldState hold;
  SpindleCheck spindle;
  StatusWatch status;
  GuardWatch guard;
  double started = 0.0;
  double progress_at = 0.0;  ///< A reply, or motion.
  bool at_rest = false;      ///< While it is being stopped: nothing moves.
};

/// What a step makes of a job: its next state, what the operator and the journal are told, and why
/// the stream is to be stopped, if it is. `notes` are told before it is stopped.
struct SendStep {
  SendState state;
  std::vector<std::string> notes;
  std::optional<StreamFault> fault;
};

/// What a job is sent under.
struct SendRules {
  const ControllerInfo& info;
  const SenderOptions& options;
  bool guarded = false;  ///< A guard verifies the spindle, not the controller's own report.
};

/// The decisions of a Sender as functions of values: none of them reads a clock, waits, or touches
/// link, guard, journal or operator. `now` in s. @pre state as the last step left it
namespace send_step {

/// Whether lines may leave at all.
bool may_send(const SendState& state, const SendRules& rules);
/// Whether everything sent is answered and carried out.
bool drained(const SendState& state, const LineTracker& tracker);
/// Whether a line fits into what the controller can receive. @param waiting  bytes that the link
/// has not taken yet.
bool has_room(const OutgoingLine& line, const LineTracker& tracker, const SendRules& rules,
              bool waiting);
/// Why a line must not leave: it cuts, and the spindle is not verified.
std::optional<StreamFault> cut_fault(const SendState& state, const OutgoingLine& line,
                                     const SendRules& rules);
/// A line leaves. @param first  nothing else is on its way.
SendState handed_over(SendState state, const OutgoingLine& line, bool first, double now);

/// A line was answered. @param last  nothing else is on its way.
SendState acknowledged(SendState state, bool last, double now);
/// Whether that answer lets a barrier be passed, so that everything sent is carried out.
bool passes_barrier(const SendState& state, bool last);

/// Whether to ask for a report now. @return a state that counts the question as asked
struct Question {
  SendState state;
  bool ask = false;
  std::optional<StreamFault> fault;  ///< The last one was not answered.
};
Question ask_status(SendState state, const SenderOptions& options, double now);
/// Takes a report: position, motion, overrides; judges what the controller does.
SendStep reported(SendState state, const StatusReport& report, const SendRules& rules, double now);
/// Counts it, if it tells that the controller stands idle with nothing planned.
SendState count_idle(SendState state, const ControllerInfo& info);

/// Judges what the guard has found last: interlocks, and a spindle that turns.
SendStep guarded(SendState state, const SenderOptions& options, double now);
/// In kSpindle: goes on once the spindle does what it was asked for.
SendStep verify_spindle(SendState state, const SendRules& rules, double now);
/// Neither a reply nor motion for too long.
SendStep watch_for_stall(SendState state, const LineTracker& tracker, const SenderOptions& options,
                         double now);

/// A reply that is neither an ok nor a report: a note, a fault, or nothing.
SendStep other_reply(SendState state, const Reply& reply, std::int64_t oldest_line);
/// While the stream is being stopped only what the machine does counts. Lines are not taken any
/// more: which reply belongs to which may be the very thing that is wrong.
SendState reported_while_stopping(SendState state, const StatusReport& report,
                                  const ControllerInfo& info);

/// How long to wait for bytes, s. @param waiting  bytes that the link has not taken yet.
double wait_time(const SendState& state, bool guarded, bool waiting, double now);

}  // namespace send_step

}  // namespace lensforge
