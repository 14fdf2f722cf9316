// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <sstream>
#include <string_view>
#include <utility>

#include "app/commands/send_command.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

constexpr std::chrono::milliseconds kRedraw{150};
constexpr std::chrono::seconds kPlainLine{5};
constexpr int kBarWidth = 24;
/// The pace is trusted once so much was cut, share of the file and s.
constexpr double kPaceShare = 0.01;
constexpr double kPaceSeconds = 20.0;

/// "X1.00 Y2.00 Z-0.500"
std::string position_text(const Eigen::Vector3d& at) {
  std::string text("X");
  text.append(fixed(at.x(), 2)).append(" Y").append(fixed(at.y(), 2));
  return text.append(" Z").append(fixed(at.z(), 3));
}

/// Share of the file that was taken, 0 … 1.
double share_of(const SendEvent& event, const JobView& job) {
  if (job.bytes <= 0) return 0.0;
  const double share = static_cast<double>(event.byte) / static_cast<double>(job.bytes);
  return std::clamp(share, 0.0, 1.0);
}

std::string bar(double share) {
  const auto filled = static_cast<std::size_t>(share * kBarWidth);
  return std::string(filled, '#').append(kBarWidth - filled, '.');
}

std::string rounded(double value) { return fixed(value, 0); }

std::string progress_text(const SendEvent& event, const JobView& job, double left) {
  return rounded(std::floor(100.0 * share_of(event, job))) + " %  line " +
         std::to_string(event.acknowledged) + " of " + std::to_string(job.lines) + "  " +
         duration_text(event.seconds) + " gone, " + duration_text(left) + " left";
}

std::string machine_text(const SendEvent& event) {
  std::string text(state_name(event.report.state));
  if (event.position) text.append("  ").append(position_text(*event.position));
  if (event.report.feed) text += "  F" + rounded(*event.report.feed);
  text += "  S" + rounded(event.rpm_asked) + " asked, " + rounded(event.rpm_seen) +
          (event.rpm_is_measured ? " measured" : " reported");
  return text;
}

/// Fill level of a buffer: "12/15".
std::string level(int free, int size) {
  return size > 0 ? std::to_string(std::clamp(size - free, 0, size)) + "/" + std::to_string(size)
                  : std::to_string(free) + " free";
}

std::string buffer_text(const SendEvent& event, const JobView& job) {
  std::string text = "buffers ";
  if (const auto& room = event.report.room) {
    text += "planner " + level(room->blocks, job.planner_blocks) + ", receive " +
            level(room->bytes, job.rx_bytes);
  } else {
    text += "not reported";
  }
  const auto& share = event.report.overrides;
  if (share && *share != Eigen::Vector3i::Constant(100)) {
    text += "  overrides F" + std::to_string(share->x()) + " R" + std::to_string(share->y()) +
            " S" + std::to_string(share->z()) + " %";
  }
  if (!event.report.pins.empty()) text += "  inputs " + printable_line(event.report.pins);
  return text;
}

/// A reader of standard error that does not keep up must not keep the sender waiting: a pipe that
/// is ready takes more than any of these lines at once.
bool can_show() {
  pollfd entry{STDERR_FILENO, POLLOUT, 0};
  return ::poll(&entry, 1, 0) > 0;
}

}  // namespace

std::string duration_text(double seconds) {
  const long whole = std::lround(seconds);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60,
                whole % 60);
  return text.data();
}

void TimeLeft::take(const SendEvent& event) {
  if (event.report.state == ReportedState::kHold) held_ += event.seconds - last_;
  last_ = event.seconds;
  const double share = share_of(event, job_);
  left_ = job_.estimate * (1.0 - share);
  if (job_.bytes <= 0) return;
  const double begun = static_cast<double>(job_.first_byte) / static_cast<double>(job_.bytes);
  const double spent = event.seconds - held_;
  const double cut = share - begun;
  if (cut > kPaceShare && spent > kPaceSeconds) left_ = spent / cut * (1.0 - share);
}

namespace {

/// A running job in three lines: progress; the machine's state; buffers and warnings.
std::vector<std::string> view_lines(const SendEvent& event, const JobView& job, double left,
                                    const std::string& warning) {
  std::vector<std::string> lines = {
      bar(share_of(event, job)) + "  " + progress_text(event, job, left), machine_text(event),
      buffer_text(event, job)};
  if (!warning.empty()) lines.back() += "  ! " + printable_line(warning);
  return lines;
}

}  // namespace

OperatorView::OperatorView(bool quiet, const JobView& job)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), job_(job) {}

OperatorView::~OperatorView() {
  if (drawn_ > 0 && can_show()) std::fputs("\n", stderr);
}

void OperatorView::take(const SendEvent& event, double left) {
  if (quiet_ || event.kind == SendEventKind::kReading || !can_show()) return;
  if (!event.message.empty()) {
    note(event.message);
    warning_ = event.message;
  }
  const Clock::time_point now = Clock::now();
  const Clock::duration wait = terminal_ ? Clock::duration(kRedraw) : kPlainLine;
  if (event.message.empty() && now - shown_ < wait) return;
  if (terminal_) {
    shown_ = now;
    return show(view_lines(event, job_, left, warning_));
  }
  if (now - shown_ < wait) return;
  shown_ = now;
  const std::string line = progress_text(event, job_, left) + "  " + machine_text(event) + "  " +
                           buffer_text(event, job_);
  std::fprintf(stderr, "%s\n", line.c_str());
}

void OperatorView::note(const std::string& text) {
  wipe();
  const Console console(false, false);
  console.begin();
  console.note(text);
}

void OperatorView::show(const std::vector<std::string>& lines) {
  wipe();
  const std::size_t width = terminal_width() - 1;
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) text += "\n";
    text += lines[i].substr(0, width) + "\033[K";
  }
  std::fputs(text.c_str(), stderr);
  drawn_ = lines.size();
}

/// Back to where the lines begin, and nothing from there on.
void OperatorView::wipe() {
  if (drawn_ == 0) return;
  std::fputs("\r", stderr);
  if (drawn_ > 1) std::fprintf(stderr, "\033[%zuA", drawn_ - 1);
  std::fputs("\033[J", stderr);
  drawn_ = 0;
}

namespace {

/// Bytes read to identify a file: more than any first line of ours.
constexpr std::size_t kFirstLine = 1 << 16;

[[noreturn]] void refuse_sink(const std::filesystem::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// The first line of a file without its end; empty if it cannot be read.
std::string first_line(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  std::string text(kFirstLine, '\0');
  const ssize_t count = file.open() ? ::pread(file.number(), text.data(), text.size(), 0) : 0;
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  const std::size_t end = text.find('\n');
  return end == std::string::npos ? std::string() : text.substr(0, end);
}

/// True if a terminal is the one from which this process was started, not a machine's port.
bool is_own_terminal(int descriptor) {
  struct stat about {};
  struct stat own {};
  if (::fstat(descriptor, &about) != 0) return false;
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fstat(number, &own) == 0 && own.st_rdev == about.st_rdev && S_ISCHR(own.st_mode)) {
      return true;
    }
  }
  return false;
}

void require_own(const std::filesystem::path& path, int descriptor, const SinkKind& kind) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0) refuse_sink(path, system_reason(errno));
  if (S_ISBLK(about.st_mode)) refuse_sink(path, "is a disk; name a file or a pipe");
  if (::isatty(descriptor) != 0 && !is_own_terminal(descriptor)) {
    refuse_sink(path,
                "is a serial port or another terminal, where text may move a machine; name a file "
                "or a pipe");
  }
  if (!S_ISREG(about.st_mode) || about.st_size == 0 || kind.begins(first_line(path))) return;
  refuse_sink(path,
              std::string("exists and is no ") + kind.name + " of lensforge; name another file");
}

/// "2026-07-30T14:05:09.250Z": now, UTC.
std::string time_stamp() {
  using std::chrono::milliseconds;
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto ms = std::chrono::duration_cast<milliseconds>(since).count();
  const std::time_t seconds = ms / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 32> day{};
  std::strftime(day.data(), day.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%s.%03dZ", day.data(), static_cast<int>(ms % 1000));
  return text.data();
}

/// True if a text begins like time_stamp().
bool begins_with_time(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00.000Z";
  if (text.size() < kForm.size()) return false;
  return std::equal(kForm.begin(), kForm.end(), text.begin(), [](char form, char c) {
    return form == '0' ? c >= '0' && c <= '9' : c == form;
  });
}

}  // namespace

// Without O_NONBLOCK a named pipe without a reader would block here for ever.
TextSink::TextSink(const std::filesystem::path& path, const SinkKind& kind)
    : path_(path),
      file_(path == "-"
                ? ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0)
                : ::open(path.c_str(),
                         O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666)) {
  const int error = errno;
  if (!file_.open()) {
    refuse_sink(path, "cannot be written: " +
                          (error == ENXIO ? "nobody reads from this pipe" : system_reason(error)));
  }
  if (path != "-") require_own(path, file_.number(), kind);
}

// Standard output may be shared and is not made non-blocking: a pipe that poll() reports ready
// accepts a line of up to PIPE_BUF bytes whole and at once.
std::string TextSink::write(const std::string& line) {
  if (!file_.open()) return {};
  const std::string text = line + "\n";
  std::string_view left = text;
  while (!left.empty()) {
    pollfd entry{file_.number(), POLLOUT, 0};
    const bool whole = left.size() == text.size();
    if (whole && ::poll(&entry, 1, 0) == 0) {
      ++lost_;
      return {};
    }
    const ssize_t count = ::write(file_.number(), left.data(), left.size());
    if (count > 0) left.remove_prefix(static_cast<std::size_t>(count));
    if (count >= 0 || errno == EINTR) continue;
    if (errno == EAGAIN && whole) {
      ++lost_;
      return {};
    }
    const int error = errno;
    file_ = Descriptor();
    return path_.string() + ": not written any more: " + system_reason(error);
  }
  return {};
}

long TextSink::take_lost() { return std::exchange(lost_, 0); }

namespace {

/// Interval of progress lines in the log when nothing happens, s.
constexpr double kStanding = 60.0;

/// Reports, soft limits, homing, spindle and laser, rates, accelerations and travels.
constexpr std::array kSettings = {10,  11,  12,  13,  20,  21,  22,  30,  31,  32,  100,
                                  101, 102, 110, 111, 112, 120, 121, 122, 130, 131, 132};

std::string settings_text(const ControllerInfo& info) {
  std::string text;
  for (const int number : kSettings) {
    const std::optional<double> value = info.setting(number);
    if (!value) continue;
    std::ostringstream word;
    word << " $" << number << "=" << *value;
    text += word.str();
  }
  return text.empty() ? " none" : text;
}

std::string standing_text(const SendEvent& event) {
  std::string text = "carried out up to line " + std::to_string(event.executed) + ", " +
                     std::string(state_name(event.report.state));
  if (event.position) text.append(", ").append(position_text(*event.position));
  return text + ", " + fixed(event.rpm_seen, 0) + " of " + fixed(event.rpm_asked, 0) + " rpm";
}

/// Longest line, bytes: that of the options.
constexpr std::size_t kLongestLogLine = 1 << 14;

/// "2026-07-30T14:05:09.250Z lensforge 0.1.0 send …", as written by begin().
bool begins_log(std::string_view line) {
  constexpr std::string_view kBegin = "  lensforge ";
  constexpr std::size_t kTime = std::string_view("0000-00-00T00:00:00.000Z").size();
  return begins_with_time(line) && line.substr(kTime).starts_with(kBegin);
}

constexpr SinkKind kLog{"log", begins_log};

}  // namespace

JobLog::JobLog(const SendSettings& settings, Warn warn) : warn_(std::move(warn)) {
  if (!settings.has_log()) return;
  try {
    file_ = TextSink(settings.log_path(), kLog);
  } catch (const InputError& refused) {
    if (!settings.log.empty()) throw InputError(std::string("--log: ") + refused.what());
    warn_(std::string("warning: no log: ") + refused.what());
  }
}

void JobLog::line(const std::string& text) {
  if (!file_.open()) return;
  const std::string failure =
      file_.write(time_stamp() + "  " + printable_line(text, kLongestLogLine));
  if (!failure.empty()) warn_("warning: the log stops here: " + failure);
}

void JobLog::begin(const OptionSet& options, const JobIdentity& job) {
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;  // Names need not be UTF-8.
  line(program_mark() + " send " + options.used().dump(-1, ' ', false, kReplace));
  line("program " + job.name + ", " + std::to_string(job.bytes) + " bytes, sha256 " + job.sha256);
}

void JobLog::controller(const ControllerInfo& info) {
  line("controller " + info.dialect.name + ", " + info.banner + ", version " + info.version +
       ", options " + info.options + ", " + std::to_string(info.rx_bytes) + " bytes received, " +
       std::to_string(info.planner_blocks) + " motions planned" +
       (info.line_numbers ? ", reports line numbers" : ", reports no line numbers"));
  line("settings" + settings_text(info));
  line("G54 begins at " + position_text(info.start.origins[0]) + " of the machine");
}

void JobLog::preflight(const ProgramFacts& facts, const Findings& findings) {
  std::istringstream text(facts_text(facts));
  for (std::string words; std::getline(text, words);) line("pre-flight:" + words.substr(1));
  for (const std::string& warning : findings.warnings) line("pre-flight: warning: " + warning);
  for (const std::string& refusal : findings.refusals) line("pre-flight: refused: " + refusal);
  if (findings.refusals.empty()) line("pre-flight: passed");
}

void JobLog::resume(const ResumePlan& plan) {
  line("resumed at line " + std::to_string(plan.line));
  for (const std::string& step : plan.steps) line("resume: " + step);
}

void JobLog::take(const SendEvent& event) {
  if (!event.message.empty()) {
    const std::string stop = event.kind == SendEventKind::kStop ? "STOP: " : "";
    return line("line " + std::to_string(event.acknowledged) + ": " + stop + event.message + " (" +
                standing_text(event) + ")");
  }
  if (event.seconds < next_standing_) return;
  next_standing_ = event.seconds + kStanding;
  line("line " + std::to_string(event.acknowledged) + ": " + standing_text(event));
}

void JobLog::end(const SendResult& result) {
  line("end: " + std::string(status_word(result.status)) + ": " + result.reason);
  line("end: sent up to line " + std::to_string(result.sent) + ", taken up to line " +
       std::to_string(result.acknowledged) + ", carried out up to line " +
       std::to_string(result.executed) + ", " +
       (result.at_rest ? "the machine has stopped" : "the machine was not seen to come to rest") +
       ", took " + duration_text(result.seconds));
}

namespace {

std::string kind_word(SendEventKind kind) {
  switch (kind) {
    case SendEventKind::kStatus:
      return "status";
    case SendEventKind::kNote:
      return "note";
    case SendEventKind::kReading:
      return "reading";
    case SendEventKind::kStop:
      break;
  }
  return "stop";
}

template <class Value>
nlohmann::json or_null(const std::optional<Value>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

template <class Vector>
nlohmann::json list_of(const std::optional<Vector>& value) {
  if (!value) return nullptr;
  return {value->x(), value->y(), value->z()};
}

nlohmann::json standing_json(const SendEvent& event, const JobView& view, double left) {
  nlohmann::json json = {{"state", state_name(event.report.state)},
                         {"seconds", event.seconds},
                         {"line", event.acknowledged},
                         {"sent", event.sent},
                         {"executed", event.executed},
                         {"percent", 100.0 * share_of(event, view)},
                         {"left", left},
                         {"position", list_of(event.position)},
                         {"feed", or_null(event.report.feed)},
                         {"rpm_asked", event.rpm_asked},
                         {"rpm", event.rpm_seen},
                         {"overrides", list_of(event.report.overrides)},
                         {"inputs", event.report.pins}};
  const auto& room = event.report.room;
  json["free"] =
      room ? nlohmann::json{{"motions", room->blocks}, {"bytes", room->bytes}} : nlohmann::json();
  return json;
}

/// Lines of write().
bool begins_events(std::string_view line) {
  const nlohmann::json first = nlohmann::json::parse(line, nullptr, false);
  const auto is_text = [&](const char* key) {
    return first.contains(key) && first[key].is_string();
  };
  return first.is_object() && is_text("event") && is_text("file") && is_text("sha256") &&
         is_text("time") && begins_with_time(first["time"].get<std::string>());
}

constexpr SinkKind kEventSink{"events file", begins_events};

}  // namespace

JobEvents::JobEvents(const SendSettings& settings, Warn warn) : warn_(std::move(warn)) {
  if (settings.events.empty()) return;
  try {
    file_ = TextSink(settings.events, kEventSink);
  } catch (const InputError& refused) {
    throw InputError(std::string("--events: ") + refused.what());
  }
}

void JobEvents::begin(const JobIdentity& job, const JobView& view) {
  job_ = job;
  view_ = view;
  SendEvent nothing;
  nothing.byte = view.first_byte;
  last_ = standing_json(nothing, view, view.estimate);
  last_["state"] = nullptr;
  nlohmann::json object = last_;
  object["event"] = "begin";
  object["lines"] = view.lines;
  object["bytes"] = view.bytes;
  object["estimate"] = view.estimate;
  object["origin"] = {view.origin.x(), view.origin.y(), view.origin.z()};
  write(std::move(object));
}

void JobEvents::take(const SendEvent& event, double left) {
  if (!file_.open()) return;
  last_ = standing_json(event, view_, left);
  nlohmann::json object = last_;
  object["event"] = kind_word(event.kind);
  if (!event.message.empty()) object["message"] = event.message;
  write(std::move(object));
}

void JobEvents::end(const SendResult& result) {
  nlohmann::json object = last_;
  object["event"] = "end";
  object["status"] = status_word(result.status);
  object["cause"] = cause_name(result.cause);
  object["message"] = result.reason;
  object["seconds"] = result.seconds;
  object["line"] = result.acknowledged;
  object["sent"] = result.sent;
  object["executed"] = result.executed;
  object["at_rest"] = result.at_rest;
  write(std::move(object));
}

void JobEvents::write(nlohmann::json object) {
  if (!file_.open()) return;
  object["time"] = time_stamp();
  object["file"] = job_.name;
  object["sha256"] = job_.sha256;
  if (const long lost = file_.take_lost(); lost > 0) object["lost"] = lost;
  const auto replace = nlohmann::json::error_handler_t::replace;
  const std::string failure = file_.write(object.dump(-1, ' ', false, replace));
  if (!failure.empty()) warn_("warning: the events end here: " + failure);
}

}  // namespace lensforge::app
