// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "machine/stream/controller_info.h"
#include "machine/stream/line_tracker.h"
#include "machine/stream/send_state.h"
#include "machine/stream/sender.h"
#include "machine/stream/stream_fault.h"

namespace lensforge {

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
