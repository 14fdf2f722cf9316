// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace lensforge {

/// Why a stream was stopped.
enum class StopCause {
  kNone,
  kInterrupted,      ///< Somebody asked for it.
  kGarbledReply,     ///< A reply that no controller sends.
  kCountMismatch,    ///< More or fewer replies than lines.
  kError,            ///< The controller refused a line.
  kAlarm,            ///< The controller is in alarm.
  kReset,            ///< The controller started afresh.
  kStall,            ///< No answer, or no motion and no answer.
  kLinkLost,         ///< Unplugged, closed.
  kDoor,             ///< The controller reports its safety door open.
  kHeld,             ///< Held from outside for longer than allowed.
  kUnexpectedState,  ///< Somebody homes, jogs, checks or puts the controller to sleep.
  kSpindle,          ///< Not at speed, failed, or not to be verified.
  kInterlock,        ///< Door, vacuum, coolant, e-stop on the bus.
  kJournal,          ///< The journal cannot be kept.
  kProgram,          ///< The program cannot be read on, or was changed.
};

/// "garbled reply", "link lost" …
std::string_view cause_name(StopCause cause);

/// A reason to stop the stream, on its way to the place that stops it.
class StreamFault : public std::runtime_error {
 public:
  StreamFault(StopCause cause, const std::string& reason)
      : std::runtime_error(reason), cause_(cause) {}
  [[nodiscard]] StopCause cause() const { return cause_; }

 private:
  StopCause cause_;
};

}  // namespace lensforge
