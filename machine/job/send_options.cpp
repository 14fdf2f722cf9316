// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/job/send_options.h"

#include <functional>

#include "core/error.h"
#include "machine/guard/register_map.h"

namespace lensforge {
namespace {

using O = SendOptions;
using R = Row<O>;

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

/// A member of the sender's options, or of those for coming back.
template <class Member>
auto sender(Member member) {
  return [member](auto& o) -> auto& { return std::invoke(member, o.sender); };
}
template <class Member>
auto entry(Member member) {
  return [member](auto& o) -> auto& { return std::invoke(member, o.entry); };
}

OptionTable<O> controller_rows() {
  return {
      R::text("--port", &O::port, "PORT",
              "controller: /dev/ttyUSB0[:115200], tcp:HOST:PORT or sim:[grbl|grblhal]"),
      R::word<std::string>("--dialect", &O::dialect, {{"grbl", "grbl"}, {"grblhal", "grblhal"}},
                           "dialect that a --dry-run without --port checks"),
      R::flag("--home", &O::home, "home the machine first"),
      R::flag("--character-counting", sender(&SenderOptions::character_counting),
              "keep the controller's buffer filled instead of waiting for each ok"),
      R::number("--hold-limit", sender(&SenderOptions::hold_limit), Limits::between(0, kMaxHold),
                "s", "end the job after a hold longer than this; 0: no limit"),
      R::flag("--dry-run", &O::dry_run,
              "check only: the program, and with --port the controller, which runs it in its "
              "check mode ($C)"),
      R::flag("--allow-changed", &O::allow_changed,
              "send a program that was changed since cam wrote it: warn instead of refusing")};
}

OptionTable<O> guard_rows() {
  return {R::text("--spindle", &O::spindle, "MAP[@PLACE]",
                  "watch the spindle over Modbus: a shipped register map or a file, and its port"),
          R::word<SpindleOwner>(
              "--spindle-driver", &O::owner,
              {{"host", SpindleOwner::kHost}, {"controller", SpindleOwner::kController}},
              "who commands the spindle"),
          R::flag("--spindle-by-hand", &O::spindle_by_hand,
                  "the spindle is switched by hand, as that of a router: cuts need no M3"),
          R::text("--interlocks", &O::interlocks, "MAP[@PLACE]",
                  "also watch a device with interlocks such as door and vacuum"),
          R::number("--spindle-timeout", sender(&SenderOptions::spindle_timeout),
                    Limits::between(kMinWait, kMaxSpinUp), "s", "maximum wait for a spindle speed"),
          R::number("--spin-up", &O::spin_up, Limits::between(0, kMaxSpinUp), "s",
                    "time of each spindle change in the estimate")};
}

OptionTable<O> journal_rows() {
  return {R::text("--journal", &O::journal, "FILE", "journal file; default FILE.ngc.journal"),
          R::flag("--resume", &O::resume,
                  "continue after a fault, with homing and a safe re-entry into the cut"),
          R::flag("--restart", &O::restart,
                  "start from the beginning, although a journal is unfinished"),
          R::whole("--margin", entry(&ResumeOptions::margin), Limits::between(1, kMaxMargin),
                   "minimum number of lines, before the last one carried out, that are cut again"),
          R::length("--ramp", entry(&ResumeOptions::ramp), Limits::between(kMinRamp, kMaxRamp),
                    "length of the path over which the tool descends when resuming"),
          R::length("--lift", entry(&ResumeOptions::lift), Limits::between(kMinLift, kMaxLift),
                    "height at which the descent begins")};
}

RegisterMap map_of(const std::string& text) {
  const std::size_t at = text.find('@');
  RegisterMap map = read_register_map(find_register_map(text.substr(0, at)));
  if (at != std::string::npos) set_endpoint(map, text.substr(at + 1));
  return map;
}

}  // namespace

const OptionTable<SendOptions>& send_fields() {
  static const OptionTable<O> table = [] {
    OptionTable<O> all;
    for (const OptionTable<O>& rows : {controller_rows(), guard_rows(), journal_rows()}) {
      all.insert(all.end(), rows.begin(), rows.end());
    }
    return all;
  }();
  return table;
}

void validate(const SendOptions& options) {
  require_limits(send_fields(), options);
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
