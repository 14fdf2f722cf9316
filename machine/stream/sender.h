// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "machine/stream/controller_dialogue.h"

namespace lensforge {

class Clock;
class Guard;
class Journal;
class ProgramFeed;

/// Options for streaming a program. Times in s.
struct SenderOptions {
  /// Keep the controller's receive buffer filled instead of waiting for each line's ok.
  bool character_counting = false;
  double status_interval = 0.2;   ///< Between two ?; ≥ 0.2.
  double reply_timeout = 3.0;     ///< Longest wait for the answer to ?; then it is a stall.
  double progress_timeout = 5.0;  ///< Longest time without reply or motion; then it is a stall.
  double spindle_timeout = 60.0;  ///< Limit for the spindle to reach a speed or to stop.
  double hold_timeout = 15.0;     ///< Limit for the machine to come to rest in a feed hold.
  double guard_timeout = 5.0;     ///< Limit for reading all interlocks once, at the start.
  /// Longest hold from outside before the job ends; 0 for no limit.
  double hold_limit = 0.0;
};

/// Operator's request during a job.
enum class OperatorKey {
  kHold,
  kResume,
  kFeedUp,    ///< By 10 % of the programmed feed.
  kFeedDown,  ///< By 10 % of the programmed feed.
  kFeedNormal,
  kRapidFull,
  kRapidHalf,
  kRapidQuarter,
  kSpindleUp,    ///< By 10 % of the programmed speed; not with a guard, which expects that speed.
  kSpindleDown,  ///< Like kSpindleUp.
  kSpindleNormal,
};

/// Kind of a SendEvent.
enum class SendEventKind {
  kStatus,   ///< A status report arrived; no message.
  kNote,     ///< A message for the operator.
  kReading,  ///< A spindle speed: at intervals while constant, at once when it changes.
  kStop,     ///< The stream is being stopped, with the reason; the feed hold was sent.
};

/// Progress of a job, sent with every status report and every message.
struct SendEvent {
  SendEventKind kind = SendEventKind::kStatus;
  StatusReport report;                      ///< Latest report.
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  std::int64_t sent = 0;
  std::int64_t acknowledged = 0;
  std::int64_t executed = 0;
  std::int64_t byte = 0;  ///< Offset after the acknowledged line.
  double rpm_asked = 0.0;
  double rpm_seen = 0.0;         ///< From the guard, or the controller's report.
  bool rpm_is_measured = false;  ///< By the guard or an encoder; else it is the commanded speed.
  double seconds = 0.0;          ///< Since the job's start.
  std::string message;           ///< A sentence for the operator, or empty.
};

/// The caller's controls of a running job.
struct SendControl {
  std::stop_token stop;   ///< Feed hold, wait, soft reset.
  std::stop_token reset;  ///< Soft reset at once.
  std::function<void(const SendEvent&)> watch;
  std::function<std::optional<OperatorKey>()> keys;
};

enum class SendStatus {
  kDone,         ///< The program reached its end and the machine has stopped.
  kInterrupted,  ///< Ended on request: held, then reset.
  kFault,        ///< Held, see the cause.
};

/// Result of a job.
struct SendResult {
  SendStatus status = SendStatus::kFault;
  StopCause cause = StopCause::kNone;
  std::string reason;             ///< In one line.
  std::int64_t sent = 0;          ///< Last line that was sent, in part or whole.
  std::int64_t acknowledged = 0;  ///< Every line up to it was accepted.
  std::int64_t executed = 0;      ///< At least every line up to it was executed.
  bool at_rest = false;           ///< The controller reported that nothing moves.
  double seconds = 0.0;

  [[nodiscard]] bool done() const { return status == SendStatus::kDone; }
};

/// Parts of a sender; guard and journal are optional. All must outlive it.
struct SenderParts {
  Wire& wire;
  Clock& clock;
  Guard* guard = nullptr;      ///< Null: the controller's own report is checked.
  Journal* journal = nullptr;  ///< Null: the job cannot be resumed.
};

/// Streams a program to a controller of the Grbl family.
///
/// Lines with motion at feed are sent only while the spindle is verified; before a change of
/// spindle or tool, a pause and the end, everything sent is executed. After any fault nothing more
/// of the program is sent, a feed hold is sent, the spindle stays as it is, and the journal records
/// the reason.
class Sender {
 public:
  /// @param info  must outlive the sender. @param first_line every line before it counts as
  ///        executed.
  Sender(const SenderParts& parts, const ControllerInfo& info, const SenderOptions& options,
         std::int64_t first_line)
      : parts_(parts), info_(info), options_(options), first_line_(first_line) {}

  /// Streams all lines of `feed`. Faults of the link, the spindle, the disk or the program are
  /// reported in the result, not thrown.
  SendResult run(ProgramFeed& feed, const SendControl& control);

 private:
  SenderParts parts_;
  const ControllerInfo& info_;
  SenderOptions options_;
  std::int64_t first_line_;
};

}  // namespace lensforge
