// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "machine/guard/guard.h"
#include "machine/link/link.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_feed.h"

namespace lensforge {

/// How a program is streamed. Times in s.
struct SenderOptions {
  /// Keep the controller's receive buffer filled instead of waiting for each line's ok.
  bool character_counting = false;
  double status_interval = 0.2;   ///< Between two ?, ≥ 0.2: five a second.
  double reply_timeout = 3.0;     ///< A ? that stays unanswered for longer is a stall.
  double progress_timeout = 5.0;  ///< Neither a reply nor motion for longer is a stall.
  double spindle_timeout = 60.0;  ///< For the spindle to reach a speed or to stop.
  double hold_timeout = 15.0;     ///< For the machine to come to rest in a feed hold.
  double guard_timeout = 5.0;     ///< For all interlocks to be read once, at the beginning.
  /// A hold from outside ends the job after this; 0 waits for ever.
  double hold_limit = 0.0;
};

/// What an operator asks for while a job runs.
enum class OperatorKey {
  kHold,
  kResume,
  kFeedUp,    ///< By 10 % of the feed in the program.
  kFeedDown,  ///< Likewise.
  kFeedNormal,
  kRapidFull,
  kRapidHalf,
  kRapidQuarter,
  kSpindleUp,  ///< By 10 % of the speed in the program; not under a guard, which expects that one.
  kSpindleDown,  ///< Likewise.
  kSpindleNormal,
};

/// What a SendEvent is about.
enum class SendEventKind {
  kStatus,   ///< A status report came; no message.
  kNote,     ///< Something happened that the operator should know.
  kReading,  ///< A speed of the spindle, now and then while it stays and when it moves.
  kStop,     ///< The stream is being stopped: the reason. The feed hold is on its way.
};

/// Where a job stands; told with every status report and with every message.
struct SendEvent {
  SendEventKind kind = SendEventKind::kStatus;
  StatusReport report;                      ///< The last one.
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  std::int64_t sent = 0;
  std::int64_t acknowledged = 0;
  std::int64_t executed = 0;
  std::int64_t byte = 0;  ///< Offset behind the acknowledged line.
  double rpm_asked = 0.0;
  double rpm_seen = 0.0;         ///< Of the guard, or what the controller reports.
  bool rpm_is_measured = false;  ///< By the guard or an encoder; else what was commanded.
  double seconds = 0.0;          ///< Since the job began.
  std::string message;           ///< A sentence for the operator, or empty.
};

/// The caller's end of a running job.
struct SendControl {
  std::stop_token stop;   ///< Feed hold, wait, soft reset.
  std::stop_token reset;  ///< Soft reset at once.
  std::function<void(const SendEvent&)> watch;
  std::function<std::optional<OperatorKey>()> keys;
};

enum class SendStatus {
  kDone,         ///< The program came to its end and the machine has stopped.
  kInterrupted,  ///< Somebody asked for the end: held, then reset.
  kFault,        ///< Held, see the cause.
};

/// How a job ended.
struct SendResult {
  SendStatus status = SendStatus::kFault;
  StopCause cause = StopCause::kNone;
  std::string reason;             ///< In one line.
  std::int64_t sent = 0;          ///< Last line that was handed over, in part or whole.
  std::int64_t acknowledged = 0;  ///< Every line up to it was taken.
  std::int64_t executed = 0;      ///< Every line up to it was carried out, at least.
  bool at_rest = false;           ///< The controller said that nothing moves any more.
  double seconds = 0.0;

  [[nodiscard]] bool done() const { return status == SendStatus::kDone; }
};

/// What a sender works with; all but guard and journal are needed, all must outlive it.
struct SenderParts {
  Wire& wire;
  Clock& clock;
  Guard* guard = nullptr;      ///< Without one, the controller's own report is what is verified.
  Journal* journal = nullptr;  ///< Without one, nothing can be resumed.
};

/// Streams a program to a controller of the Grbl family.
///
/// Lines with motion at feed only leave while the spindle is verified; before a change of spindle
/// or tool, a pause and the end everything sent is carried out. Whatever goes wrong: nothing more
/// of the program leaves, a feed hold does, the spindle stays as it is, and the journal says why.
class Sender {
 public:
  /// @param info  must outlive the sender. @param first_line  every line before it counts as done.
  Sender(const SenderParts& parts, const ControllerInfo& info, const SenderOptions& options,
         std::int64_t first_line)
      : parts_(parts), info_(info), options_(options), first_line_(first_line) {}

  /// Streams all that `feed` gives. Never throws for what happens on the link, at the spindle, on
  /// the disk or in the program.
  SendResult run(ProgramFeed& feed, const SendControl& control);

 private:
  SenderParts parts_;
  const ControllerInfo& info_;
  SenderOptions options_;
  std::int64_t first_line_;
};

}  // namespace lensforge
