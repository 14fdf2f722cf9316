// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/job/send_options.h"

#include "core/error.h"
#include "core/schema/description.h"
#include "machine/guard/register_map.h"

namespace lensforge {
namespace {

/// Longest hold, about 11 days, s.
constexpr double kMaxHold = 1e6;
/// A spindle is looked at some times a second, and none takes an hour to start, s.
constexpr double kMinWait = 0.1;
constexpr double kMaxSpinUp = 3600.0;
/// The ramp is written in pieces of 0.1 mm, and the heights with five decimals, mm.
constexpr double kMinRamp = 0.1;
constexpr double kMaxRamp = 1000.0;
constexpr double kMinLift = 0.01;
constexpr double kMaxLift = 100.0;
constexpr double kMaxMargin = 100000;

void describe_controller(Description& d, SendOptions& o) {
  d.text("--port", o.port, "PORT",
         "controller: /dev/ttyUSB0[:115200], tcp:HOST:PORT or sim:[grbl|grblhal]");
  d.word("--dialect", o.dialect, {{"grbl", "grbl"}, {"grblhal", "grblhal"}},
         "dialect that a --dry-run without --port checks");
  d.flag("--home", o.home, "home the machine first");
  d.flag("--character-counting", o.sender.character_counting,
         "keep the controller's buffer filled instead of waiting for each ok");
  d.number("--hold-limit", o.sender.hold_limit, Limits::between(0, kMaxHold), "s",
           "end the job after a hold longer than this; 0: no limit");
  d.flag("--dry-run", o.dry_run,
         "check only: the program, and with --port the controller, which runs it in its "
         "check mode ($C)");
  d.flag("--allow-changed", o.allow_changed,
         "send a program that was changed since cam wrote it: warn instead of refusing");
}

void describe_guard(Description& d, SendOptions& o) {
  d.text("--spindle", o.spindle, "MAP[@PLACE]",
         "watch the spindle over Modbus: a shipped register map or a file, and its port");
  d.word("--spindle-driver", o.owner,
         {{"host", SpindleOwner::kHost}, {"controller", SpindleOwner::kController}},
         "who commands the spindle");
  d.flag("--spindle-by-hand", o.spindle_by_hand,
         "the spindle is switched by hand, as that of a router: cuts need no M3");
  d.text("--interlocks", o.interlocks, "MAP[@PLACE]",
         "also watch a device with interlocks such as door and vacuum");
  d.number("--spindle-timeout", o.sender.spindle_timeout, Limits::between(kMinWait, kMaxSpinUp),
           "s", "maximum wait for a spindle speed");
  d.number("--spin-up", o.spin_up, Limits::between(0, kMaxSpinUp), "s",
           "time of each spindle change in the estimate");
}

void describe_journal(Description& d, SendOptions& o) {
  d.text("--journal", o.journal, "FILE", "journal file; default FILE.ngc.journal");
  d.flag("--resume", o.resume,
         "continue after a fault, with homing and a safe re-entry into the cut");
  d.flag("--restart", o.restart, "start from the beginning, although a journal is unfinished");
  d.whole("--margin", o.entry.margin, Limits::between(1, kMaxMargin),
          "minimum number of lines, before the last one carried out, that are cut again");
  d.length("--ramp", o.entry.ramp, Limits::between(kMinRamp, kMaxRamp),
           "length of the path over which the tool descends when resuming");
  d.length("--lift", o.entry.lift, Limits::between(kMinLift, kMaxLift),
           "height at which the descent begins");
}

RegisterMap map_of(const std::string& text) {
  const std::size_t at = text.find('@');
  RegisterMap map = read_register_map(find_register_map(text.substr(0, at)));
  if (at != std::string::npos) set_endpoint(map, text.substr(at + 1));
  return map;
}

}  // namespace

void describe(Description& d, SendOptions& o) {
  describe_controller(d, o);
  describe_guard(d, o);
  describe_journal(d, o);
}

void validate(const SendOptions& options) {
  require_limits(options);
  if (options.port.empty() && !options.dry_run) {
    throw InputError(
        "--port: is missing; name the controller, e.g. /dev/ttyUSB0 (only --dry-run works "
        "without)");
  }
  if (options.resume && options.restart) {
    throw InputError("--resume and --restart exclude each other");
  }
  if (options.resume && options.dry_run) {
    throw InputError("--resume and --dry-run exclude each other");
  }
  if (options.spindle_by_hand && !options.spindle.empty()) {
    throw InputError("--spindle-by-hand and --spindle exclude each other");
  }
  if (options.spindle.empty() && !options.interlocks.empty()) {
    throw InputError("--interlocks " + options.interlocks + ": needs --spindle as well");
  }
  if (options.port.starts_with("sim:") && !options.spindle.empty()) {
    throw InputError("--spindle " + options.spindle +
                     ": the simulated controller has its own clock and no Modbus; leave it out");
  }
}

std::vector<RegisterMap> register_maps(const SendOptions& options) {
  std::vector<RegisterMap> maps;
  if (!options.spindle.empty()) maps.push_back(map_of(options.spindle));
  if (!options.interlocks.empty()) maps.push_back(map_of(options.interlocks));
  if (!maps.empty()) (void)only_spindle(maps, options.owner);
  return maps;
}

}  // namespace lensforge
