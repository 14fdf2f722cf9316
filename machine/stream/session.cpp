// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/session.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/program_feed.h"

namespace lensforge {
namespace {

constexpr double kAnswerTimeout = 5.0;
constexpr double kCheckTimeout = 10.0;
constexpr double kLastTry = 0.5;       ///< A reset is answered at once.
constexpr double kLeaveTimeout = 5.0;  ///< A reset is repeated in it, see Dialogue::reset().
constexpr std::int64_t kLinesBetweenReports = 256;

/// Preconditions of a reset: nothing moves, and the machine may be taken over.
void require_rest(Dialogue& dialogue, const StatusReport& report, bool resume) {
  // Door:0: the door is closed again; the machine waits to be resumed as in a hold.
  if (report.state == ReportedState::kDoor && report.sub_state != 0) {
    throw InputError("the controller reports its safety door open; close it first");
  }
  const bool free = report.state == ReportedState::kIdle || report.state == ReportedState::kAlarm ||
                    report.state == ReportedState::kCheck || report.state == ReportedState::kSleep;
  if (free) return;
  if (!resume) {
    throw InputError("the controller is in state " + std::string(state_name(report.state)) +
                     ": let it finish, or continue a job with --resume");
  }
  dialogue.hold();
}

/// Resets a controller that has not answered yet. @return its banner
std::string wake(Dialogue& dialogue) {
  const std::string banner = dialogue.try_reset(kLastTry);
  if (banner.empty()) Dialogue::silence();
  return banner;
}

/// A machine continues homing without its sender: after a failed wait it must be stopped.
void home_machine(Dialogue& dialogue, Wire& wire, double timeout) {
  try {
    dialogue.ask("$H", timeout);
  } catch (const StreamFault& fault) {
    const bool stopped_itself =
        fault.cause() == StopCause::kError || fault.cause() == StopCause::kAlarm;
    if (stopped_itself) throw;
    wire.discard();
    wire.urgent(realtime::kSoftReset);
    throw StreamFault(fault.cause(), std::string(fault.what()) +
                                         " while homing: the controller was reset, home it again");
  }
}

/// In check mode a controller takes every program and moves nothing. A soft reset leaves that mode
/// at any time, with half a line received or a line under way too; $C would need an idle parser.
/// An interruption does not cut this short: it takes a reply, or kLeaveTimeout.
void leave_check_mode(Wire& wire, Clock& clock) {
  try {
    Dialogue(wire, clock, {}).reset(kLeaveTimeout);
  } catch (const StreamFault& fault) {
    throw StreamFault(fault.cause(), std::string(fault.what()) +
                                         "; it may still be in check mode ($C), where it moves "
                                         "nothing: reset it before the next job");
  }
}

std::int64_t check_lines(Dialogue& dialogue, std::istream& program, const ControllerInfo& info,
                         const RunControl& control) {
  FeedOptions options;
  options.dialect = info.dialect;
  options.start = info.start;
  ProgramFeed feed(program, options);
  std::int64_t checked = 0;
  while (const std::optional<OutgoingLine> line = feed.next()) {
    try {
      dialogue.ask(line->text, kCheckTimeout);
    } catch (const StreamFault& fault) {
      throw StreamFault(fault.cause(), "line " + std::to_string(line->line) + ": " + fault.what());
    }
    if (++checked % kLinesBetweenReports == 0) {
      control.report({"checking on the controller", static_cast<double>(line->next_offset), 0.0,
                      "line " + std::to_string(line->line)});
    }
  }
  return checked;
}

}  // namespace

ControllerInfo open_session(Wire& wire, Clock& clock, const SessionOptions& options,
                            const std::stop_token& stop) {
  Dialogue dialogue(wire, clock, stop);
  const std::optional<StatusReport> report = dialogue.ask_status(options.wake_timeout);
  if (report) require_rest(dialogue, *report, options.resume);
  // After a limit was hit, Grbl answers nothing but a reset; homing then finds the position again.
  if (!report && !options.home) dialogue.silence();
  const std::string banner = report ? dialogue.reset() : wake(dialogue);
  if (options.home) home_machine(dialogue, wire, options.home_timeout);
  return learn_controller(dialogue, banner);
}

double measure_round_trip(Wire& wire, Clock& clock, const std::stop_token& stop) {
  Dialogue dialogue(wire, clock, stop);
  std::array<double, 5> times{};
  for (double& time : times) {
    const double begin = clock.now();
    dialogue.ask("", kAnswerTimeout);
    time = clock.now() - begin;
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

std::int64_t check_on_controller(Wire& wire, Clock& clock, std::istream& program,
                                 const ControllerInfo& info, const RunControl& control) {
  Dialogue dialogue(wire, clock, control.stop_token());
  std::int64_t checked = 0;
  try {
    dialogue.ask("$C", kAnswerTimeout);
    checked = check_lines(dialogue, program, info, control);
  } catch (const LinkLost&) {
    throw;
  } catch (...) {
    leave_check_mode(wire, clock);
    throw;
  }
  leave_check_mode(wire, clock);
  return checked;
}

}  // namespace lensforge
