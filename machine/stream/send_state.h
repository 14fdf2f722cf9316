// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "machine/guard/guard.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/status_report.h"

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

}  // namespace lensforge
