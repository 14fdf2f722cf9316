// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/register_map_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Coils and registers are numbered apart, whatever function reads or writes them.
using Cell = std::pair<bool, int>;

Cell written_cell(const RegisterAddress& at) {
  return {at.function == 5 || at.function == 15, at.address};
}

/// The cell that a reading shares with writes; nothing for inputs, which cannot be written.
std::optional<Cell> read_cell(const RegisterAddress& at) {
  if (at.function != 1 && at.function != 3) return std::nullopt;
  return Cell{at.function == 1, at.address};
}

/// What a command leaves behind: the last value of each cell.
using Outcome = std::map<Cell, std::uint16_t>;

Outcome outcome_of(const std::vector<WriteStep>& steps) {
  Outcome outcome;
  for (const WriteStep& step : steps) outcome[written_cell(step.at)] = step.value;
  return outcome;
}

bool holds_all(const Outcome& outcome, const Outcome& part) {
  return std::all_of(part.begin(), part.end(), [&](const auto& cell) {
    const auto found = outcome.find(cell.first);
    return found != outcome.end() && found->second == cell.second;
  });
}

class MapCheck {
 public:
  MapCheck(const RegisterMap& map, std::string file) : map_(map), file_(std::move(file)) {}

  void run() const {
    if (!map_.spindle) return;
    check_standstill(*map_.spindle);
    check_reading("spindle.status.speed", map_.spindle->speed.scale);
    check_fault(*map_.spindle);
    check_signals(*map_.spindle);
    if (map_.spindle->commands) check_commands(*map_.spindle->commands);
  }

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& rule) const {
    throw InputError(file_ + ": " + key + ": " + rule);
  }

  void check_standstill(const SpindleMap& spindle) const {
    const double slowest = (1.0 - spindle.tolerance) * spindle.rpm_min;
    if (spindle.stopped_rpm < slowest) return;
    refuse("spindle.stopped_rpm", number_text(spindle.stopped_rpm) +
                                      ": must be below what passes for rpm_min, " +
                                      number_text(slowest) + " (rpm_min less tolerance)");
  }

  /// The scale has to tell speeds apart as finely as they are judged, and a standstill from them.
  void check_reading(const std::string& key, const SpeedScale& scale) const {
    const SpindleMap& spindle = *map_.spindle;
    check_resolution(key, scale);
    const auto raw = raw_of_rpm(scale, spindle.rpm_per_hz, 0.0);
    if (raw && rpm_of_raw(scale, spindle.rpm_per_hz, *raw) <= spindle.stopped_rpm) return;
    refuse(key, "with this scale and offset no reading means standing still; 0 rpm must have one");
  }

  void check_resolution(const std::string& key, const SpeedScale& scale) const {
    const SpindleMap& spindle = *map_.spindle;
    for (const double rpm : {spindle.rpm_min, spindle.rpm_max}) {
      const auto raw = raw_of_rpm(scale, spindle.rpm_per_hz, rpm);
      if (!raw) refuse(key, "rpm_min to rpm_max must fit into the register with this scale");
      const double back = rpm_of_raw(scale, spindle.rpm_per_hz, *raw);
      if (std::abs(back - rpm) <= spindle.tolerance * rpm) continue;
      refuse(key, "the register's nearest speed to " + number_text(rpm) + " rpm is " +
                      number_text(back) +
                      " rpm: farther off than tolerance; a finer scale is "
                      "needed");
    }
  }

  void check_fault(const SpindleMap& spindle) const {
    if (!spindle.fault || !spindle.fault->texts.contains(spindle.fault->clear)) return;
    refuse("spindle.status.fault.texts",
           std::to_string(spindle.fault->clear) + " means no fault (clear), and must have no text");
  }

  void check_signals(const SpindleMap& spindle) const {
    std::vector<const ReadSignal*> signals{&spindle.speed.signal};
    if (spindle.fault) signals.push_back(&spindle.fault->signal);
    if (spindle.at_speed) signals.push_back(&spindle.at_speed->signal);
    if (spindle.direction) signals.push_back(&spindle.direction->signal);
    for (std::size_t i = 0; i < signals.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) require_other_bits(*signals[i], *signals[k]);
      require_unwritten(*signals[i]);
    }
    for (const Interlock& interlock : map_.interlocks) {
      require_unwritten(interlock.flag.signal);
      for (const ReadSignal* signal : signals) require_other_bits(interlock.flag.signal, *signal);
    }
  }

  void require_other_bits(const ReadSignal& a, const ReadSignal& b) const {
    const bool same = a.at.function == b.at.function && a.at.address == b.at.address;
    if (!same || (a.mask & b.mask) == 0) return;
    refuse(a.key, address_text(a.at) + " is read as " + b.key +
                      " too; each needs an address or bits (mask) of its own");
  }

  /// What is read where it was written tells what was asked for, not what the device does.
  void require_unwritten(const ReadSignal& signal) const {
    const std::optional<Cell> cell = read_cell(signal.at);
    if (!cell || !map_.spindle->commands) return;
    const SpindleCommands& commands = *map_.spindle->commands;
    bool written = written_cell(commands.set_speed) == *cell;
    for (const auto* steps : {&commands.run_forward, &commands.run_reverse, &commands.stop}) {
      written = written || outcome_of(*steps).contains(*cell);
    }
    if (!written) return;
    refuse(signal.key, address_text(signal.at) +
                           " is written by spindle.commands: it holds the requested value, not "
                           "what is; read the device's own");
  }

  void check_commands(const SpindleCommands& commands) const {
    check_resolution("spindle.commands.set_speed", commands.scale);
    require_different("run_forward", commands.run_forward, "stop", commands.stop);
    require_own_speed("run_forward", commands, commands.run_forward);
    if (!commands.run_reverse.empty()) {
      require_different("run_reverse", commands.run_reverse, "stop", commands.stop);
      require_different("run_reverse", commands.run_reverse, "run_forward", commands.run_forward);
      require_own_speed("run_reverse", commands, commands.run_reverse);
    }
    require_own_speed("stop", commands, commands.stop);
  }

  /// Of two commands neither may leave behind all that the other does.
  void require_different(const std::string& name, const std::vector<WriteStep>& steps,
                         const std::string& other_name, const std::vector<WriteStep>& other) const {
    const Outcome one = outcome_of(steps);
    const Outcome two = outcome_of(other);
    if (!holds_all(one, two) && !holds_all(two, one)) return;
    refuse("spindle.commands." + name, "leaves the registers as " + other_name +
                                           " does; they must differ in a value, for example "
                                           "machine/guard/maps/generic_plc.toml");
  }

  /// Only a stop may write the speed's register: 0 rpm.
  void require_own_speed(const std::string& name, const SpindleCommands& commands,
                         const std::vector<WriteStep>& steps) const {
    for (const WriteStep& step : steps) {
      if (written_cell(step.at) != written_cell(commands.set_speed)) continue;
      const double rpm = rpm_of_raw(commands.scale, map_.spindle->rpm_per_hz, step.value);
      if (name == "stop" && rpm <= map_.spindle->stopped_rpm) continue;
      refuse("spindle.commands." + name, "writes the register of set_speed, " +
                                             address_text(step.at) +
                                             "; the speed needs a register of its own");
    }
  }

  const RegisterMap& map_;
  std::string file_;
};

}  // namespace

void check_register_map(const RegisterMap& map, const std::string& file) {
  MapCheck(map, file).run();
}

}  // namespace lensforge
