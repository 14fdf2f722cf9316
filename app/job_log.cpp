// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/job_log.h"

#include <array>
#include <sstream>
#include <utility>

#include "app/json_output.h"
#include "app/operator_view.h"
#include "core/error.h"
#include "core/text/printable.h"
#include "core/text/version.h"

namespace lensforge::app {
namespace {

/// How often a log says where the job stands when nothing happens, s.
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
constexpr std::size_t kLongestLine = 1 << 14;

/// "2026-07-30T14:05:09.250Z  lensforge 0.1.0 send …", as begin() writes it.
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
  const std::string failure = file_.write(time_stamp() + "  " + printable_line(text, kLongestLine));
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

}  // namespace lensforge::app
