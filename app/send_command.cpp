// SPDX-License-Identifier: GPL-3.0-or-later
#include <exception>
#include <optional>

#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/job_events.h"
#include "app/job_log.h"
#include "app/operator_view.h"
#include "app/option_set.h"
#include "app/progress_display.h"
#include "app/send_confirm.h"
#include "app/send_output.h"
#include "app/send_settings.h"
#include "app/terminal_keys.h"
#include "core/error.h"
#include "machine/job/send_job.h"

namespace lensforge::app {
namespace {

/// The job before the operator's eyes and under the keys.
struct Operator {
  Operator(bool quiet, const JobView& job)
      : left(job), keys(&InterruptWatch::interrupt), view(quiet, job) {}

  TimeLeft left;
  TerminalKeys keys;
  OperatorView view;
};

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
    // None where progress is not shown.
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
                      so_far.facts.time.seconds, info.planner_blocks, info.rx_bytes};
    events_->begin(so_far.job, job);
    operator_.emplace(options_.common().quiet, job);
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

  /// For the record, if there is one by now.
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
  } catch (const std::exception& why) {
    watcher.refused(why);
    throw;
  }
}

void report(const OptionSet& options, const SendSettings& settings, const Console& console,
            const SendSummary& summary) {
  for (const std::string& warning : summary.findings.warnings) {
    console.note("warning: " + warning);
  }
  console.result(send_json(options, summary), send_text(settings, summary));
  if (!summary.result || summary.result->done()) return;
  console.note(summary.result->reason + "; " + settings.job.journal_of(settings.file).string() +
               " records how far the job came; continue with --resume");
}

int exit_code(const SendSummary& summary) {
  if (summary.result && summary.result->status == SendStatus::kInterrupted) return kInterrupted;
  if (summary.result && !summary.result->done()) return kFailed;
  return summary.facts.time.stream_limited() ? kLimitMissed : kDone;
}

}  // namespace

int send_command(const Arguments& command_line) {
  SendSettings settings;
  OptionSet options("send",
                    "Streams a G-code program to a Grbl-family controller. Keys while it runs: " +
                        std::string(kKeyHelp) + ".");
  add_send_options(options, settings);
  options.parse(command_line);
  require_consistent(settings, options.common().json);
  const Console console(options.common().json, options.common().quiet);
  console.begin();  // The operator is asked and warned before the machine accepts the job.
  try {
    const SendSummary summary = watched_job(options, settings, console);
    report(options, settings, console, summary);
    return exit_code(summary);
  } catch (const Interrupted&) {
    console.note("interrupted; nothing was sent");
    return kInterrupted;
  } catch (const StreamFault& fault) {
    if (fault.cause() != StopCause::kInterrupted) throw;
    console.note(std::string(fault.what()) + "; nothing of the program was sent");
    return kInterrupted;
  }
}

}  // namespace lensforge::app
