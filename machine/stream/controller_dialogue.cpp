// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/controller_dialogue.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/text/words.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

std::string_view cause_name(StopCause cause) {
  switch (cause) {
    case StopCause::kNone:
      return "none";
    case StopCause::kInterrupted:
      return "interrupted";
    case StopCause::kGarbledReply:
      return "garbled reply";
    case StopCause::kCountMismatch:
      return "reply count";
    case StopCause::kError:
      return "error";
    case StopCause::kAlarm:
      return "alarm";
    case StopCause::kReset:
      return "reset";
    case StopCause::kStall:
      return "stall";
    case StopCause::kLinkLost:
      return "link lost";
    case StopCause::kDoor:
      return "door";
    case StopCause::kHeld:
      return "held";
    case StopCause::kUnexpectedState:
      return "unexpected state";
    case StopCause::kSpindle:
      return "spindle";
    case StopCause::kInterlock:
      return "interlock";
    case StopCause::kJournal:
      return "journal";
    case StopCause::kProgram:
      return "program";
  }
  return {};
}

void Wire::line(std::string_view text) {
  lines_ += text;
  lines_ += '\n';
}

void Wire::urgent(char byte) {
  urgent_ += byte;
  flush();
}

void Wire::flush() {
  while (!urgent_.empty()) {
    const std::size_t count = link_.write(urgent_);
    if (count == 0) return;
    urgent_.erase(0, count);
  }
  while (written_ < lines_.size()) {
    const std::size_t count = link_.write(std::string_view(lines_).substr(written_));
    if (count == 0) return;
    written_ += count;
  }
  lines_.clear();
  written_ = 0;
}

void Wire::discard() {
  lines_.clear();
  written_ = 0;
}

void Wire::receive(double wait, const std::function<void(const Reply&)>& take) {
  reader_.feed(link_.read(wait), take);
}

namespace {

constexpr double kAskAgain = 0.5;          ///< Between two ? to a controller that is silent, s.
constexpr double kStopCheck = 0.1;         ///< Longest wait without a look at the stop token, s.
constexpr double kResetAgain = 1.5;        ///< A reset that got lost is sent again, s.
constexpr double kQuietAfterBanner = 0.3;  ///< Start-up lines and messages follow a banner, s.

using Kind = Reply::Kind;

[[noreturn]] void no_answer_to(const std::string& what) {
  throw StreamFault(StopCause::kStall, "the controller does not answer " + what);
}

/// "Grbl 0.9j ['$' for help]", or a report with commas: "<Idle,MPos:0.000,…,WPos:…>".
bool is_too_old(const Reply& reply) {
  if (reply.kind == Kind::kBanner) return reply.text.starts_with("Grbl 0.");
  return reply.kind == Kind::kUnknown && reply.text.starts_with('<') &&
         reply.text.find(",MPos:") != std::string::npos;
}

}  // namespace

bool at_rest(const StatusReport& report) {
  switch (report.state) {
    case ReportedState::kIdle:
    case ReportedState::kAlarm:
    case ReportedState::kCheck:
    case ReportedState::kSleep:
    case ReportedState::kTool:
      return true;
    case ReportedState::kHold:
      return report.sub_state.value_or(0) == 0;
    case ReportedState::kDoor:
      return report.sub_state.value_or(0) <= 1;
    default:
      return false;
  }
}

void Dialogue::pause_until_reply(double until) {
  if (stop_.stop_requested()) throw StreamFault(StopCause::kInterrupted, "interrupted");
  wire_.flush();
  const double wait = std::clamp(until - clock_.now(), 0.0, kStopCheck);
  wire_.receive(wait, [this](const Reply& reply) { take(reply); });
}

void Dialogue::take(const Reply& reply) {
  if (is_too_old(reply)) {
    throw InputError("the controller runs firmware older than Grbl 1.1 ('" +
                     printable_line(reply.text) +
                     "'), whose reports tell too little; load Grbl 1.1 or grblHAL onto its board");
  }
  replies_.push_back(reply);
}

std::optional<StatusReport> Dialogue::ask_status(double timeout) {
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    replies_.clear();
    wire_.urgent(realtime::kStatusReport);
    const double until = std::min(end, clock_.now() + kAskAgain);
    while (clock_.now() < until) {
      pause_until_reply(until);
      for (const Reply& reply : replies_) {
        if (reply.status) return reply.status;
      }
      replies_.clear();
    }
  }
  return std::nullopt;
}

void Dialogue::silence() { no_answer_to("?; is it switched on, is it the right port and speed?"); }

StatusReport Dialogue::status(double timeout) {
  const std::optional<StatusReport> report = ask_status(timeout);
  if (!report) no_answer_to("?");
  return *report;
}

std::vector<Reply> Dialogue::ask(const std::string& line, double timeout) {
  replies_.clear();
  wire_.line(line);
  std::vector<Reply> answer;
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    pause_until_reply(end);
    for (const Reply& reply : replies_) {
      if (reply.kind == Kind::kOk) return answer;
      if (reply.kind == Kind::kError) {
        throw StreamFault(StopCause::kError, line + " was refused: " + explain_error(reply.code));
      }
      if (reply.kind == Kind::kAlarm) {
        throw StreamFault(StopCause::kAlarm, line + ": " + explain_alarm(reply.code));
      }
      if (reply.kind == Kind::kUnknown) {
        throw StreamFault(StopCause::kGarbledReply,
                          line + ": '" + printable_line(reply.text) + "'");
      }
      answer.push_back(reply);
    }
    replies_.clear();
  }
  no_answer_to(line);
}

std::string Dialogue::reset(double timeout) {
  std::string banner = try_reset(timeout);
  if (banner.empty()) no_answer_to("a reset");
  return banner;
}

std::string Dialogue::try_reset(double timeout) {
  replies_.clear();
  wire_.discard();
  const double end = clock_.now() + timeout;
  std::string banner;
  double until = end;
  double again = clock_.now();
  while (clock_.now() < until) {
    if (banner.empty() && clock_.now() >= again) {
      wire_.urgent(realtime::kSoftReset);
      again = clock_.now() + kResetAgain;
    }
    pause_until_reply(until);
    for (const Reply& reply : replies_) {
      if (reply.kind != Kind::kBanner) continue;
      banner = reply.text;
      until = clock_.now() + kQuietAfterBanner;
    }
    replies_.clear();
  }
  return banner;
}

StatusReport Dialogue::hold(double timeout) {
  wire_.discard();
  wire_.urgent(realtime::kFeedHold);
  const double end = clock_.now() + timeout;
  while (clock_.now() < end) {
    StatusReport report = status();
    if (at_rest(report)) return report;
    pause_until_reply(clock_.now() + kStatusPause);
  }
  throw StreamFault(StopCause::kStall, "the machine does not stop in a feed hold");
}

namespace {

constexpr double kAnswerTimeout = 5.0;
constexpr std::array<std::string_view, 6> kSystems = {"G54", "G55", "G56", "G57", "G58", "G59"};

/// Bytes of the receive buffer that stay empty: rings cannot be filled wholly.
constexpr int kRingGap = 1;

/// Maximum setting, size or position; a larger value or no number was garbled.
constexpr double kLargestNumber = 1e9;

std::vector<double> numbers(std::string_view text) {
  std::vector<double> values;
  while (!text.empty()) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !(std::abs(value) <= kLargestNumber)) return values;
    values.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.starts_with(',')) return values;
    text.remove_prefix(1);
  }
  return values;
}

void take_setting(const Reply& reply, ControllerInfo& info) {
  int number = 0;
  const char* end = reply.name.data() + reply.name.size();
  if (std::from_chars(reply.name.data(), end, number).ptr != end) return;
  const std::vector<double> values = numbers(reply.value);
  if (!values.empty()) info.settings[number] = values.front();
}

/// "VN,15,128": letters, planner blocks, bytes; grblHAL appends the number of axes.
void take_options(const std::string& value, ControllerInfo& info) {
  const std::size_t comma = std::min(value.find(','), value.size());
  info.options = value.substr(0, comma);
  info.line_numbers = info.options.find('N') != std::string::npos;
  if (comma == value.size()) return;
  const std::vector<double> sizes = numbers(std::string_view(value).substr(comma + 1));
  if (sizes.size() < 2 || sizes[0] < 1.0 || sizes[1] <= kRingGap) return;
  info.planner_blocks = static_cast<int>(sizes[0]);
  info.rx_bytes = static_cast<int>(sizes[1]) - kRingGap;
}

void take_build(const std::vector<Reply>& replies, ControllerInfo& info) {
  bool hal = info.banner.starts_with("GrblHAL");
  for (const Reply& reply : replies) {
    if (reply.name == "VER") info.version = reply.value;
    if (reply.name == "FIRMWARE") hal = hal || reply.value == "grblHAL";
  }
  info.dialect = hal ? grblhal_dialect() : grbl_dialect();
  info.rx_bytes = static_cast<int>(info.dialect.rx_bytes) - kRingGap;
  info.planner_blocks = info.dialect.planner_blocks;
  for (const Reply& reply : replies) {
    if (reply.name == "OPT") take_options(reply.value, info);
  }
}

/// [G54:…] … [G59:…], what shifts all of them (G92), and the tool's length, which G49 takes away.
void take_origins(const std::vector<Reply>& replies, ControllerInfo& info) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (const Reply& reply : replies) {
    const std::vector<double> values = numbers(reply.value);
    if (reply.name == "TLO" && !values.empty()) {
      info.start.stated_length = info.report_unit() * (values.size() < 3 ? values[0] : values[2]);
    }
    if (values.size() < 3) continue;
    const Eigen::Vector3d at =
        info.report_unit() * Eigen::Vector3d(values[0], values[1], values[2]);
    if (reply.name == "G92") shift += at;
    if (reply.name == "G28") info.start.g28 = at;
    if (reply.name == "G30") info.start.g30 = at;
    const auto* const system = std::find(kSystems.begin(), kSystems.end(), reply.name);
    if (system != kSystems.end()) {
      info.start.origins[static_cast<std::size_t>(system - kSystems.begin())] = at;
    }
  }
  for (Eigen::Vector3d& origin : info.start.origins) origin += shift;
}

void take_status(const StatusReport& report, ControllerInfo& info) {
  info.status = report;
  if (const auto at = info.machine_position(report)) info.start.position = *at;
  if (!report.room || !at_rest(report)) return;
  // Measured while empty, which is more reliable than the stated size.
  info.reports_room = true;
  info.rx_bytes = report.room->bytes;
  info.planner_blocks = report.room->blocks;
}

}  // namespace

std::optional<double> ControllerInfo::setting(int number) const {
  const auto found = settings.find(number);
  return found == settings.end() ? std::nullopt : std::optional(found->second);
}

std::optional<Eigen::Vector3d> ControllerInfo::machine_position(const StatusReport& report) const {
  if (report.machine_position) return report_unit() * *report.machine_position;
  const auto& offset = report.work_offset ? report.work_offset : status.work_offset;
  if (!report.work_position || !offset) return std::nullopt;
  return report_unit() * (*report.work_position + *offset);
}

ControllerInfo learn_controller(Dialogue& dialogue, const std::string& banner) {
  ControllerInfo info;
  info.banner = banner;
  take_build(dialogue.ask("$I", kAnswerTimeout), info);
  for (const Reply& reply : dialogue.ask("$$", kAnswerTimeout)) {
    if (reply.kind == Reply::Kind::kSetting) take_setting(reply, info);
  }
  if (info.settings.empty()) {
    throw InputError("the controller reports no settings ($$); is it of the Grbl family?");
  }
  take_origins(dialogue.ask("$#", kAnswerTimeout), info);
  take_status(dialogue.status(), info);
  return info;
}

namespace {

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
  std::string banner = dialogue.try_reset(kLastTry);
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
