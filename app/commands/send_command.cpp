// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/send_command.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <system_error>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/interrupt.h"
#include "app/frame/option_set.h"
#include "app/frame/terminal_keys.h"
#include "cam/cam.h"
#include "cam/coupon/coupon_job.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/text/words.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/link/port.h"
#include "machine/send.h"

namespace lensforge::app {

namespace fs = std::filesystem;

void describe(Description& d, SendSettings& settings) {
  d.text("FILE", settings.file, "", "G-code program").needed = true;
  describe(d, settings.job);
  d.flag("--yes", settings.yes, "do not ask before resuming");
  d.flag("--keys", settings.keys,
         "take keys from standard input though it is no terminal, for a program that sends");
  d.text("--log", settings.log, "FILE",
         "log file, appended to an earlier one; default FILE.ngc.log");
  d.text("--events", settings.events, "FILE",
         "append what happens as JSON, one object a line: to an earlier events file, a new "
         "one or a pipe; - is standard output");
}

namespace {

/// @throw InputError for options that exclude each other or are missing.
void require_consistent(const SendSettings& settings, bool json) {
  if (json && settings.events == "-") {
    throw InputError("--events -: standard output belongs to the result with --json");
  }
  if (settings.log == "-") throw InputError("--log -: has to be a file");
  validate(settings.job);
}

nlohmann::json box_json(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", {box.min().x(), box.min().y(), box.min().z()}},
          {"max", {box.max().x(), box.max().y(), box.max().z()}}};
}

std::string box_text(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return "nothing";
  std::string text;
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (k > 0) text.append(", ");
    text.append(1, "XYZ"[k]).append(" ").append(fixed(box.min()[k], 3)).append(" to ");
    text.append(fixed(box.max()[k], 3));
  }
  return text;
}

nlohmann::json facts_json(const ProgramFacts& facts) {
  return {{"lines", facts.lines},
          {"sent_lines", facts.sent_lines},
          {"sent_bytes", facts.sent_bytes},
          {"motions", facts.motions},
          {"units", facts.inches ? "inch" : "mm"},
          {"extent", box_json(facts.extent)},
          {"cut_extent", box_json(facts.cut_extent)},
          {"top_feed", facts.top_feed},
          {"top_rpm", facts.top_rpm},
          {"tool_changes", facts.tool_changes},
          {"pauses", facts.pauses},
          {"seconds", facts.time.seconds},
          {"stream_limited", facts.time.stream_limited()},
          {"stream_limited_seconds", facts.time.stream_limited_seconds},
          {"peak_lines_per_second", facts.time.peak_lines_per_second},
          {"peak_bytes_per_second", facts.time.peak_bytes_per_second}};
}

nlohmann::json result_json(const SendResult& result) {
  return {{"cause", cause_name(result.cause)},
          {"reason", result.reason},
          {"sent", result.sent},
          {"acknowledged", result.acknowledged},
          {"executed", result.executed},
          {"at_rest", result.at_rest},
          {"seconds", result.seconds}};
}

std::string result_text(const SendResult& result) {
  return "  sent         up to line " + std::to_string(result.sent) + "\n" +  //
         "  taken        up to line " + std::to_string(result.acknowledged) + "\n" +
         "  carried out  up to line " + std::to_string(result.executed) + " for sure\n" +
         "  machine      " +
         (result.at_rest ? "stands still" : "was not seen to come to rest: look at it") + "\n" +
         "  took         " + duration_text(result.seconds) + "\n";
}

}  // namespace

std::string facts_text(const ProgramFacts& facts) {
  return "  program      " + std::to_string(facts.lines) + " lines, " +
         std::to_string(facts.motions) + " motions, up to F" + fixed(facts.top_feed, 0) + " and S" +
         fixed(facts.top_rpm, 0) + "\n" +                        //
         "  motion       " + box_text(facts.extent) + " mm\n" +  //
         "  time         " + duration_text(facts.time.seconds) +
         (facts.time.stream_limited()
              ? ", " + duration_text(facts.time.stream_limited_seconds) + " as lines arrive"
              : std::string()) +
         "\n";
}

std::string status_word(SendStatus status) {
  switch (status) {
    case SendStatus::kDone:
      return "done";
    case SendStatus::kInterrupted:
      return "interrupted";
    case SendStatus::kFault:
      break;
  }
  return "fault";
}

namespace {

/// "done", "interrupted", "fault", or "checked" of a dry run.
std::string outcome_word(const SendSummary& summary) {
  return summary.result ? status_word(summary.result->status) : "checked";
}

nlohmann::json send_json(const OptionSet& options, const SendSummary& summary) {
  nlohmann::json json = {{"status", outcome_word(summary)},
                         {"options", options.used()},
                         {"sha256", summary.job.sha256},
                         {"bytes", summary.job.bytes},
                         {"seal_holds", seal_json(summary.seal_holds)},
                         {"program", facts_json(summary.facts)},
                         {"warnings", summary.findings.warnings}};
  if (summary.controller) {
    json["controller"] = {{"dialect", summary.controller->dialect.name},
                          {"version", summary.controller->version},
                          {"rx_bytes", summary.controller->rx_bytes},
                          {"planner_blocks", summary.controller->planner_blocks},
                          {"line_numbers", summary.controller->line_numbers}};
  }
  if (summary.checked_lines) json["checked_lines"] = *summary.checked_lines;
  if (summary.plan) {
    json["resumed"] = {{"line", summary.plan->line},
                       {"entry_line", summary.plan->entry_line},
                       {"overlap_end", summary.plan->overlap_end},
                       {"steps", summary.plan->steps}};
  }
  if (summary.result) json["result"] = result_json(*summary.result);
  return json;
}

std::string send_text(const SendSettings& settings, const SendSummary& summary) {
  std::string head = settings.file + ": " + outcome_word(summary);
  if (summary.result && !summary.result->done()) head += ": " + summary.result->reason;
  std::string text = printable_line(head);
  text.append("\n").append(facts_text(summary.facts));
  text.append("  seal         ").append(seal_words(summary.seal_holds)).append("\n");
  if (summary.checked_lines) {
    text += "  controller   checked " + std::to_string(*summary.checked_lines) + " lines ($C)\n";
  }
  if (summary.result) text += result_text(*summary.result);
  return text;
}

constexpr double kStopCheck = 0.1;  ///< Longest time without a look at the stop token, s.

/// Reads the input up to Enter; empty at the end of the input.
std::string read_answer(const std::stop_token& stop) {
  while (wait_for(STDIN_FILENO, POLLIN, kStopCheck) == 0) {
    if (stop.stop_requested()) throw Interrupted();
  }
  std::array<char, 256> bytes{};
  const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  std::string answer(bytes.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
  return answer.substr(0, answer.find('\n'));
}

/// Asks on the terminal whether to continue. @throw InputError if there is no terminal or the
/// answer is not yes; Interrupted soon after `stop` requests it.
void require_consent(const std::stop_token& stop) {
  if (::isatty(STDIN_FILENO) == 0) {
    throw InputError(
        "--resume: cannot ask for confirmation, standard input is no terminal; use --yes");
  }
  std::fputs("Go on? [y/N] ", stderr);
  const std::string answer = read_answer(stop);
  if (answer != "y" && answer != "Y" && answer != "yes") {
    throw InputError("--resume: not confirmed; nothing was sent");
  }
}

/// The job before the operator's eyes and under the keys.
struct Operator {
  Operator(bool quiet, const JobView& job, KeySource source)
      : left(job), keys(&InterruptWatch::interrupt, source), view(quiet, job) {}

  TimeLeft left;
  TerminalKeys keys;
  OperatorView view;
};

/// True if `folder` has a file of this name.
bool holds(const fs::path& folder, const char* name) {
  std::error_code unreadable;
  return fs::is_regular_file(folder / name, unreadable);
}

/// Says how to make a program again that is written for another dialect, by the files beside it.
std::string way_to_make(const fs::path& program, const std::string& dialect) {
  const std::string post = " --post " + dialect;
  const fs::path folder = program.has_parent_path() ? program.parent_path() : fs::path(".");
  const bool named =
      folder.filename() == lens_file::kCut || folder.filename() == lens_file::kFrontCut;
  const fs::path above = named ? folder.parent_path() : folder / "..";
  const fs::path lens = above.empty() ? fs::path(".") : above;
  const std::string others = ", with the other options that made it";
  if (holds(folder, cam_file::kReport) && holds(lens, lens_file::kJson)) {
    const char* const face = folder.filename() == lens_file::kFrontCut ? " --face front" : "";
    return "make it with lensforge cam " + shell_word(lens.string()) + face + post + others;
  }
  if (holds(folder, coupon_file::kSheet)) {
    return "make it with lensforge coupon --out " + shell_word(folder.string()) + post + others;
  }
  const char* const command = holds(folder, nest_file::kJson) ? "nest" : "cam";
  return joined({"make it again by lensforge ", command, " with", post});
}

/// Shows a job on the terminal and puts it on record.
class JobConsole : public JobWatcher {
 public:
  JobConsole(const OptionSet& options, const SendSettings& settings, const Console& console,
             const InterruptWatch& interrupt)
      : options_(options), settings_(settings), console_(console), interrupt_(interrupt) {}

  [[nodiscard]] std::vector<NamedFile> files() const override {
    std::vector<NamedFile> files;
    if (settings_.has_log()) files.push_back({"--log", settings_.log_path()});
    const bool to_file = !settings_.events.empty() && settings_.events != "-";
    if (to_file) files.push_back({"--events", settings_.events});
    return files;
  }

  void opened(const JobIdentity& program) override {
    const Warn warn = [this](const std::string& text) { console_.note(text); };
    // A log exists from its first line on: what cannot be watched must not leave an empty one.
    events_.emplace(settings_, warn);
    log_.emplace(settings_, warn);
    log_->begin(options_, program);
  }

  void warned(const std::string& text) override {
    console_.note(text);
    log_->line(text);
  }

  void passing(const Progress& progress) override {
    if (!bar_) bar_.emplace(options_.common().quiet);
    // Empty if progress is not shown.
    if (const auto show = bar_->sink()) show(progress);
  }
  void passed() override { bar_.reset(); }

  void connected(const ControllerInfo& controller) override { log_->controller(controller); }
  void examined(const ProgramFacts& facts, const Findings& findings) override {
    log_->preflight(facts, findings);
  }

  void confirm(const JournalRecord& before, const ResumePlan& plan) override {
    console_.note("the last run ended: " +
                  (before.reason.empty() ? "no word of it" : before.reason));
    for (const std::string& step : plan.steps) console_.note("resume: " + step);
    if (!settings_.yes) require_consent(interrupt_.token());
  }
  void resumed(const ResumePlan& plan) override { log_->resume(plan); }

  void began(const SendSummary& so_far, std::int64_t first_byte) override {
    const ControllerInfo& info = *so_far.controller;
    const JobView job{so_far.job.bytes,          so_far.facts.lines,  first_byte,
                      so_far.facts.time.seconds, info.planner_blocks, info.rx_bytes,
                      info.start.origins[0]};
    events_->begin(so_far.job, job);
    operator_.emplace(options_.common().quiet, job,
                      settings_.keys ? KeySource::kAnyInput : KeySource::kTerminal);
    if (operator_->keys.active()) console_.note("keys: " + std::string(kKeyHelp));
  }
  void took(const SendEvent& event) override {
    operator_->left.take(event);
    operator_->view.take(event, operator_->left.seconds());
    log_->take(event);
    events_->take(event, operator_->left.seconds());
  }
  std::optional<OperatorKey> key() override { return operator_->keys.next(); }
  void ended(const SendResult& result) override {
    operator_.reset();
    log_->end(result);
    events_->end(result);
  }

  /// Logs the refusal if the log is already open.
  void refused(const std::exception& why) {
    if (log_) log_->line(std::string("nothing was sent: ") + why.what());
  }

 private:
  const OptionSet& options_;
  const SendSettings& settings_;
  const Console& console_;
  const InterruptWatch& interrupt_;
  std::optional<JobLog> log_;
  std::optional<JobEvents> events_;
  std::optional<ProgressDisplay> bar_;
  std::optional<Operator> operator_;
};

SendSummary watched_job(const OptionSet& options, const SendSettings& settings,
                        const Console& console) {
  const InterruptWatch interrupt(SecondInterrupt::kRequest);
  JobConsole watcher(options, settings, console, interrupt);
  try {
    return send_job(settings.file, settings.job, watcher, interrupt.token(),
                    interrupt.second_token());
  } catch (const OtherDialect& why) {
    const InputError full(
        joined({why.what(), "; ", way_to_make(settings.file, settings.job.dialect)}));
    watcher.refused(full);
    throw full;
  } catch (const std::exception& why) {
    watcher.refused(why);
    throw;
  }
}

int send_exit_code(const SendSummary& summary) {
  if (summary.result && summary.result->status == SendStatus::kInterrupted) return kInterrupted;
  if (summary.result && !summary.result->done()) return kFailed;
  return summary.facts.time.stream_limited() ? kLimitMissed : kDone;
}

CommandResult report(const OptionSet& options, const SendSettings& settings,
                     const SendSummary& summary) {
  CommandResult outcome{send_json(options, summary), send_text(settings, summary),
                        send_exit_code(summary), summary.findings.warnings};
  if (summary.result && !summary.result->done()) {
    outcome.notes.push_back(summary.result->reason + "; " +
                            settings.job.journal_of(settings.file).string() +
                            " records how far the job came; continue with --resume");
  }
  return outcome;
}

CommandResult run(CommandFrame& frame, SendSettings& settings) {
  const OptionSet& options = frame.options();
  require_consistent(settings, options.common().json);
  // The operator is asked and warned before the machine accepts the job.
  frame.console().begin();
  try {
    return report(options, settings, watched_job(options, settings, frame.console()));
  } catch (const Interrupted&) {
    return {.exit_code = kInterrupted, .notes = {"interrupted; nothing was sent"}};
  } catch (const StreamFault& fault) {
    if (fault.cause() != StopCause::kInterrupted) throw;
    return {.exit_code = kInterrupted,
            .notes = {std::string(fault.what()) + "; nothing of the program was sent"}};
  }
}

}  // namespace

int send_command(const Arguments& arguments) {
  return run_command<SendSettings>(
      {"send",
       "Streams a G-code program to a Grbl-family controller. Keys while it runs: " +
           std::string(kKeyHelp) + ".",
       run},
      arguments);
}

}  // namespace lensforge::app
