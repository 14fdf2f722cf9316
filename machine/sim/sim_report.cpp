// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_report.h"

#include <algorithm>

#include "machine/sim/sim_text.h"

namespace lensforge {
namespace {

// Reports between two that carry the field, at rest and in motion.
constexpr int kOffsetAtRest = 10;
constexpr int kOffsetInMotion = 30;
constexpr int kOverrideAtRest = 10;
constexpr int kOverrideInMotion = 20;

constexpr double kInch = 25.4;  ///< mm

double changed(double value, double by) {
  return by == 0.0 ? 100.0 : std::clamp(value + by, 10.0, 200.0);
}

std::string coordinates(const SimSnapshot& machine, const Eigen::Vector3d& point) {
  return machine.inches ? fixed_text(Eigen::Vector3d(point / kInch), 4) : fixed_text(point, 3);
}

std::string override_text(const SimSnapshot& machine) {
  std::string text("|Ov:");
  text.append(fixed_text(machine.overrides.feed, 0)).append(",");
  text.append(fixed_text(machine.overrides.rapid, 0)).append(",");
  text.append(fixed_text(machine.overrides.spindle, 0));
  std::string accessories;
  if (machine.spindle != 0) accessories += machine.spindle > 0 ? "S" : "C";
  if ((machine.coolant & 2) != 0) accessories += "F";
  if ((machine.coolant & 1) != 0) accessories += "M";
  if (!accessories.empty()) text.append("|A:").append(accessories);
  return text;
}

/// Offsets now and then; overrides likewise, never in the same report.
SimReport extras(const SimSnapshot& machine, SimCountdowns countdowns) {
  if (countdowns.offset-- <= 0) {
    countdowns.offset = (machine.rests ? kOffsetAtRest : kOffsetInMotion) - 1;
    if (countdowns.overrides <= 0) countdowns.overrides = 1;
    return {std::string("|WCO:").append(coordinates(machine, machine.offset)), countdowns};
  }
  if (--countdowns.overrides > 0) return {"", countdowns};
  countdowns.overrides = machine.rests ? kOverrideAtRest : kOverrideInMotion;
  return {override_text(machine), countdowns};
}

}  // namespace

std::optional<SimOverrides> overridden(SimOverrides before, unsigned char byte) {
  constexpr double kSteps[] = {0.0, 10.0, -10.0, 1.0, -1.0};
  if (byte >= 0x90 && byte <= 0x94) {
    before.feed = changed(before.feed, kSteps[byte - 0x90]);
  } else if (byte >= 0x95 && byte <= 0x97) {
    before.rapid = byte == 0x95 ? 100.0 : byte == 0x96 ? 50.0 : 25.0;
  } else if (byte >= 0x99 && byte <= 0x9D) {
    before.spindle = changed(before.spindle, kSteps[byte - 0x99]);
  } else {
    return std::nullopt;
  }
  return before;
}

SimReport report_of(const SimSnapshot& machine, SimCountdowns countdowns) {
  const bool absolute = (machine.mask & 1) != 0;
  const Eigen::Vector3d work = machine.position - machine.offset;
  std::string text("<");
  text.append(machine.state).append(absolute ? "|MPos:" : "|WPos:");
  text.append(coordinates(machine, absolute ? machine.position : work));
  if ((machine.mask & 2) != 0) {
    text.append("|Bf:").append(std::to_string(machine.free_blocks)).append(",");
    text.append(std::to_string(machine.free_bytes));
  }
  if (machine.number > 0) text.append("|Ln:").append(std::to_string(machine.number));
  const double speed = machine.speed * 60.0 / (machine.inches ? kInch : 1.0);
  text.append("|FS:").append(fixed_text(speed, 0)).append(",").append(fixed_text(machine.rpm, 0));
  if (machine.door_open) text.append("|Pn:D");
  SimReport more = extras(machine, countdowns);
  return {text + more.text + ">\r\n", more.next};
}

}  // namespace lensforge
