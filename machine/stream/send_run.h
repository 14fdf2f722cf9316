// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "machine/stream/buffer_audit.h"
#include "machine/stream/line_tracker.h"
#include "machine/stream/send_steps.h"
#include "machine/stream/sender.h"

namespace lensforge {

/// One run of a Sender: carries out what the steps decide (send_steps.h), and turns what comes in
/// into steps. It decides nothing itself.
class SendRun {
 public:
  /// All but `first_line` must outlive the run.
  SendRun(const SenderParts& parts, const SendRules& rules, std::int64_t first_line,
          ProgramFeed& feed, const SendControl& control);

  SendResult run();

 private:
  // send_run.cpp
  void turn();
  void obey_operator();
  void obey(OperatorKey key);
  void fill();
  void hand_over();
  void take(const Reply& reply);
  void take_ok();
  void take_status(const StatusReport& report);
  void poll_guard();
  void take_guard_records();
  void ask_status();
  /// Takes over a step's state, tells its notes and stops for its fault. @throw StreamFault
  void apply(SendStep step);
  void note(const std::string& text);
  void tell(SendEventKind kind, const std::string& message);
  [[nodiscard]] JobProgress progress() const;
  [[nodiscard]] double rpm_seen() const;

  // send_end.cpp
  SendResult end(SendStatus status, StopCause cause, std::string reason);
  SendResult stop_for(StopCause cause, std::string reason);
  void hold(StopCause cause, const std::string& reason);
  void reset();
  /// @return whether the controller greeted.
  bool take_while_stopping(double wait);

  SenderParts parts_;
  SendRules rules_;
  ProgramFeed& feed_;
  const SendControl& control_;
  LineTracker tracker_;
  BufferAudit audit_;
  SendState state_;
  std::optional<OutgoingLine> next_;  ///< Read, and not handed over yet.
};

}  // namespace lensforge
