// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/send_settings.h"

#include "core/error.h"
#include "machine/guard/map_folder.h"
#include "machine/guard/register_map_reader.h"

namespace lensforge::app {
namespace {

/// Somebody who holds a job comes back within a fortnight, s.
constexpr double kLongestWait = 1e6;
/// A spindle is looked at some times a second, and none takes an hour to start, s.
constexpr double kShortestWait = 0.1;
constexpr double kLongestSpinUp = 3600.0;
/// The ramp is written in pieces of 0.1 mm, and the heights with five decimals, mm.
constexpr double kShortestRamp = 0.1;
constexpr double kLongestRamp = 1000.0;
constexpr double kLowestLift = 0.01;
constexpr double kHighestLift = 100.0;

void add_controller_options(OptionSet& options, SendSettings& send) {
  options.text("--port", send.port, "PORT",
               "controller: /dev/ttyUSB0[:115200], tcp:HOST:PORT or sim:[grbl|grblhal]");
  options.choice("--dialect", send.dialect, {{"grbl", "grbl"}, {"grblhal", "grblhal"}},
                 "what a --dry-run without --port checks for");
  options.flag("--home", send.home, "home the machine first");
  options.flag("--character-counting", send.sender.character_counting,
               "keep the controller's buffer filled instead of waiting for each ok");
  options.number("--hold-limit", send.sender.hold_limit, Limits::between(0, kLongestWait), "s",
                 "end the job when somebody holds it for longer; 0 waits");
}

void add_guard_options(OptionSet& options, SendSettings& send) {
  options.text("--spindle", send.spindle, "MAP[@PLACE]",
               "watch the spindle over Modbus: a shipped register map or a file, and its port");
  options.choice("--spindle-driver", send.owner,
                 {{"host", SpindleOwner::kHost}, {"controller", SpindleOwner::kController}},
                 "who tells the spindle to turn");
  options.text("--interlocks", send.interlocks, "MAP[@PLACE]",
               "watch a device with door, vacuum and the like as well");
  options.number("--spindle-timeout", send.sender.spindle_timeout,
                 Limits::between(kShortestWait, kLongestSpinUp), "s", "longest wait for a speed");
  options.number("--spin-up", send.spin_up, Limits::between(0, kLongestSpinUp), "s",
                 "time of each spindle change in the estimate");
}

void add_journal_options(OptionSet& options, SendSettings& send) {
  options.text("--journal", send.journal, "FILE", "journal; FILE.ngc.journal without it");
  options.text("--log", send.log, "FILE",
               "log to hand to somebody else, appended to an earlier one; FILE.ngc.log without it");
  options.text("--events", send.events, "FILE",
               "append what happens as JSON, one object a line: to an earlier events file, a new "
               "one or a pipe; - is standard output");
  options.flag("--resume", send.resume, "go on after a fault, with homing and a safe way back in");
  options.flag("--restart", send.restart, "begin again in spite of an unfinished journal");
  options.flag("--yes", send.yes, "do not ask before resuming");
  options.integer("--margin", send.margin, Limits::between(1, 100000),
                  "lines before the last one carried out that are cut again at least");
  options.length("--ramp", send.entry.ramp, Limits::between(kShortestRamp, kLongestRamp),
                 "path over which the tool comes down when resuming");
  options.length("--lift", send.entry.lift, Limits::between(kLowestLift, kHighestLift),
                 "height at which it begins to");
}

RegisterMap map_of(const std::string& text) {
  const std::size_t at = text.find('@');
  RegisterMap map = read_register_map(find_register_map(text.substr(0, at)));
  if (at != std::string::npos) set_endpoint(map, text.substr(at + 1));
  return map;
}

}  // namespace

void add_send_options(OptionSet& options, SendSettings& settings) {
  options.positional("FILE", settings.file, "G-code program");
  add_controller_options(options, settings);
  options.flag("--dry-run", settings.dry_run,
               "check only: the program, and with --port the controller, which runs it in its "
               "check mode ($C)");
  options.flag("--allow-changed", settings.allow_changed,
               "send a program that is not as cam wrote it: warn instead of refusing");
  add_guard_options(options, settings);
  add_journal_options(options, settings);
}

void require_consistent(const SendSettings& settings, bool json) {
  if (json && settings.events == "-") {
    throw InputError("--events -: standard output belongs to the result with --json");
  }
  if (settings.port.empty() && !settings.dry_run) {
    throw InputError("--port: which controller? Only a --dry-run goes without");
  }
  if (settings.resume && settings.restart) {
    throw InputError("--resume and --restart exclude each other");
  }
  if (settings.resume && settings.dry_run) {
    throw InputError("--resume and --dry-run exclude each other");
  }
  if (settings.spindle.empty() && !settings.interlocks.empty()) {
    throw InputError("--interlocks " + settings.interlocks + ": needs --spindle as well");
  }
  if (settings.log == "-") throw InputError("--log -: has to be a file");
  const bool simulated = settings.port.starts_with("sim:");
  if (simulated && !settings.spindle.empty()) {
    throw InputError("--spindle " + settings.spindle +
                     ": the simulated controller runs in a time of its own and has no Modbus");
  }
}

std::vector<RegisterMap> register_maps(const SendSettings& settings) {
  std::vector<RegisterMap> maps;
  if (!settings.spindle.empty()) maps.push_back(map_of(settings.spindle));
  if (!settings.interlocks.empty()) maps.push_back(map_of(settings.interlocks));
  if (!maps.empty()) (void)only_spindle(maps, settings.owner);
  return maps;
}

}  // namespace lensforge::app
