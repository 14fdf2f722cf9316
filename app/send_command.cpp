// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <system_error>

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
#include "app/send_places.h"
#include "app/send_settings.h"
#include "app/terminal_keys.h"
#include "core/error.h"
#include "core/io/files.h"
#include "machine/gcode/program_seal.h"
#include "machine/guard/background_guard.h"
#include "machine/link/serial_link.h"
#include "machine/link/steady_clock.h"
#include "machine/link/tcp_link.h"
#include "machine/sim/simulated_machine.h"
#include "machine/stream/program_file.h"
#include "machine/stream/session.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Where the part lies in the simulated mill of 400 x 300 x 100 mm.
const Eigen::Vector3d kSimulatedOrigin(-350.0, -250.0, -60.0);

/// A controller and the time that it lives in.
struct Port {
  PortSpec spec;
  std::unique_ptr<SimulatedMachine> machine;
  std::unique_ptr<SteadyClock> steady;
  std::unique_ptr<Link> link;

  [[nodiscard]] Clock& clock() const {
    return machine ? static_cast<Clock&>(*machine) : static_cast<Clock&>(*steady);
  }
};

SimulatedOptions simulated_options(const std::string& name) {
  return parse_dialect(name.empty() ? "grbl" : name, "--port sim:").name == "grbl"
             ? simulated_grbl()
             : simulated_grblhal();
}

Port open_port(const std::string& text, const std::stop_token& stop) {
  Port port;
  port.spec = parse_port_spec(text);
  switch (port.spec.kind) {
    case PortSpec::Kind::kSimulated:
      port.machine = std::make_unique<SimulatedMachine>(simulated_options(port.spec.place));
      for (int i = 0; i < 6; ++i) port.machine->controller().set_origin(i, kSimulatedOrigin);
      port.link = port.machine->open();
      return port;
    case PortSpec::Kind::kSerial:
      port.link = std::make_unique<SerialLink>(port.spec);
      break;
    case PortSpec::Kind::kTcp:
      port.link = std::make_unique<TcpLink>(port.spec, stop);
      break;
  }
  port.steady = std::make_unique<SteadyClock>();
  return port;
}

/// One run of the command, step by step.
class SendRun {
 public:
  SendRun(const OptionSet& options, const SendSettings& settings, const Console& console)
      : options_(options),
        settings_(settings),
        console_(console),
        warn_([this](const std::string& text) { console_.note(text); }),
        interrupt_(SecondInterrupt::kRequest),
        maps_(register_maps(settings)),
        program_(open_program()),
        log_(settings, warn_),
        events_(settings, warn_) {}

  /// @throw what the libraries throw
  int run() {
    summary_.job = program_.identity();
    log_.begin(options_, summary_.job);
    try {
      check_seal_of_program();
      carry_out();
    } catch (const std::exception& refused) {
      log_.line(std::string("nothing was sent: ") + refused.what());
      throw;
    }
    for (const std::string& warning : summary_.findings.warnings) {
      console_.note("warning: " + warning);
    }
    if (settings_.dry_run || summary_.result) finish();
    return exit_code();
  }

 private:
  /// Before anything is made or touched.
  [[nodiscard]] ProgramFile open_program() const {
    require_apart(settings_, maps_);
    ProgressDisplay progress(options_.common().quiet);
    return ProgramFile(settings_.file, RunControl(interrupt_.token(), progress.sink()));
  }

  /// A program that was changed or cut short since cam wrote it is named before anything else.
  void check_seal_of_program() {
    summary_.seal_holds = check_seal(*program_.open(), RunControl(interrupt_.token(), {}));
    if (summary_.seal_holds.value_or(true)) return;
    const std::string broken =
        settings_.file +
        ": its seal does not hold: it is not as cam wrote it, it was changed or "
        "cut short";
    if (!settings_.allow_changed) {
      throw InputError(broken + "; make it anew, or use --allow-changed if that is meant");
    }
    warn_("warning: " + broken);
    log_.line("warning: " + broken);
  }

  void carry_out() {
    if (settings_.port.empty()) {
      examine_alone();
    } else {
      with_controller();
    }
  }

  /// Against nothing but the dialect; positions are the program's own.
  void examine_alone() {
    FactsOptions facts;
    facts.dialect = parse_dialect(settings_.dialect, "--dialect");
    facts.spin_up = settings_.spin_up;
    facts.planner.max_rate.setConstant(5000.0);
    facts.planner.acceleration.setConstant(500.0);
    summary_.facts = examine(facts);
  }

  void with_controller() {
    if (!settings_.dry_run) require_journal();
    Port port = open_port(settings_.port, interrupt_.token());
    Wire wire(*port.link);
    SessionOptions session;
    session.resume = settings_.resume;
    session.home = settings_.home || settings_.resume || port.machine;
    summary_.controller = open_session(wire, port.clock(), session, interrupt_.token());
    log_.controller(*summary_.controller);
    check(wire, port);
    if (settings_.dry_run) return check_mode(wire, port);
    std::unique_ptr<BackgroundGuard> guard;
    GuardOptions guard_options;
    guard_options.owner = settings_.owner;
    if (!maps_.empty()) guard = guard_devices(maps_, guard_options, *port.steady);
    send(wire, port, guard.get());
  }

  ProgramFacts examine(const FactsOptions& options) {
    ProgressDisplay progress(options_.common().quiet);
    const RunControl control(interrupt_.token(), progress.sink());
    try {
      ProgramFacts facts = examine_program(*program_.open(), options, control);
      const std::string lack = lack_of_motion(facts);
      if (!lack.empty()) throw InputError(settings_.file + ": " + lack);
      return facts;
    } catch (const GcodeError& refused) {
      throw InputError(settings_.file + ": " + refused.what());
    }
  }

  /// What stands in a journal must not be lost, and must be of this program.
  void require_journal() {
    const fs::path path = settings_.journal_path();
    if (settings_.resume) {
      record_ = read_journal(path);
      if (record_->job.same_program(summary_.job)) return;
      throw InputError(path.string() + ": is the journal of another program (" + record_->job.name +
                       "), not of " + settings_.file);
    }
    std::error_code none;
    if (fs::status(path, none).type() == fs::file_type::not_found) return;
    require_regular_file(path);
    if (settings_.restart || fs::is_empty(path) || read_journal(path).finished) return;
    throw InputError(path.string() +
                     ": an unfinished job; go on with --resume or begin again with --restart");
  }

  /// The program against the controller.
  void check(Wire& wire, const Port& port) {
    const ControllerInfo& info = *summary_.controller;
    FactsOptions facts;
    facts.dialect = info.dialect;
    facts.start = info.start;
    facts.spin_up = settings_.spin_up;
    facts.planner = planner_settings(info.settings);
    facts.planner.blocks = info.planner_blocks;
    const double round_trip = settings_.sender.character_counting
                                  ? 0.0
                                  : measure_round_trip(wire, port.clock(), interrupt_.token());
    const int baud = port.spec.kind == PortSpec::Kind::kSerial ? port.spec.baud : 0;
    constexpr double kUsualLine = 24.0;
    const StreamRate rate = stream_rate(info, baud, round_trip, kUsualLine);
    facts.planner.lines_per_second = rate.lines_per_second;
    facts.planner.bytes_per_second = rate.bytes_per_second;
    summary_.facts = examine(facts);
    summary_.findings = check_program(summary_.facts, info);
    check_spindle_range(summary_.facts, maps_, summary_.findings);
    log_.preflight(summary_.facts, summary_.findings);
    if (summary_.findings.refusals.empty()) return;
    std::string all;
    for (const std::string& refusal : summary_.findings.refusals) {
      all += (all.empty() ? "" : "; ") + refusal;
    }
    throw InputError(settings_.file + ": " + all);
  }

  void check_mode(Wire& wire, const Port& port) {
    ProgressDisplay progress(options_.common().quiet);
    summary_.checked_lines =
        check_on_controller(wire, port.clock(), *program_.open(), *summary_.controller,
                            RunControl(interrupt_.token(), progress.sink()));
  }

  void send(Wire& wire, const Port& port, Guard* guard) {
    const ControllerInfo& info = *summary_.controller;
    const std::unique_ptr<std::istream> program = program_.open();
    FeedOptions feed_options{info.dialect, info.line_numbers, info.start, 1, 0, {}};
    const std::unique_ptr<Journal> journal = begin_journal(feed_options);
    ProgramFeed feed(*program, feed_options);
    Sender sender({wire, port.clock(), guard, journal.get()}, info, settings_.sender,
                  feed_options.first_line);
    summary_.result = run_watched(sender, feed, feed_options.first_offset);
    log_.end(*summary_.result);
    events_.end(*summary_.result);
  }

  /// The job before the operator's eyes, on record, and under the keys.
  SendResult run_watched(Sender& sender, ProgramFeed& feed, std::int64_t first_byte) {
    const ControllerInfo& info = *summary_.controller;
    const JobView job{summary_.job.bytes,          summary_.facts.lines, first_byte,
                      summary_.facts.time.seconds, info.planner_blocks,  info.rx_bytes};
    TimeLeft left(job);
    events_.begin(summary_.job, job);
    TerminalKeys keys(&InterruptWatch::interrupt);
    if (keys.active()) console_.note("keys: " + std::string(kKeyHelp));
    OperatorView view(options_.common().quiet, job);
    SendControl control{interrupt_.token(), interrupt_.second_token(), {}, {}};
    control.keys = [&] { return keys.next(); };
    control.watch = [&](const SendEvent& event) {
      left.take(event);
      view.take(event, left.seconds());
      log_.take(event);
      events_.take(event, left.seconds());
    };
    return sender.run(feed, control);
  }

  std::unique_ptr<Journal> begin_journal(FeedOptions& feed) {
    if (!record_) {
      auto journal = Journal::create(settings_.journal_path(), summary_.job, {});
      journal->origins(summary_.controller->start.origins);
      return journal;
    }
    ResumeOptions entry = settings_.entry;
    entry.margin = settings_.margin;
    summary_.plan =
        plan_resume(*program_.open(), *record_, *summary_.controller, summary_.facts, entry);
    confirm();
    log_.resume(*summary_.plan);
    feed.first_line = summary_.plan->line;
    feed.first_offset = summary_.plan->offset;
    feed.before = summary_.plan->before;
    if (summary_.plan->line > 1) feed.start = summary_.plan->state;
    return Journal::resume(settings_.journal_path(), *record_, {});
  }

  void confirm() const {
    console_.note("the last run ended: " +
                  (record_->reason.empty() ? "no word of it" : record_->reason));
    for (const std::string& step : summary_.plan->steps) console_.note("resume: " + step);
    if (settings_.yes) return;
    require_consent(interrupt_.token());
  }

  void finish() const {
    console_.result(send_json(options_, summary_), send_text(settings_, summary_));
    if (!summary_.result || summary_.result->done()) return;
    console_.note(summary_.result->reason + "; " + settings_.journal_path().string() +
                  " knows how far it came: --resume goes on");
  }

  [[nodiscard]] int exit_code() const {
    if (summary_.result && summary_.result->status == SendStatus::kInterrupted) return kInterrupted;
    if (summary_.result && !summary_.result->done()) return kFailed;
    return summary_.facts.time.stream_limited() ? kLimitMissed : kDone;
  }

  const OptionSet& options_;
  const SendSettings& settings_;
  const Console& console_;
  Warn warn_;
  InterruptWatch interrupt_;
  std::vector<RegisterMap> maps_;
  ProgramFile program_;
  JobLog log_;
  JobEvents events_;
  std::optional<JournalRecord> record_;
  SendSummary summary_;
};

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
  try {
    return SendRun(options, settings, console).run();
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
