// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/preflight.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/text/number_text.h"
#include "machine/stream/send_steps.h"

namespace lensforge {
namespace {

/// Positions are reported with three decimals, mm.
constexpr double kTravelTolerance = 0.001;

constexpr double kBitsPerByte = 10.0;

/// Bits of $22 in grblHAL and the letter of $I in Grbl that put the machine's origin at the switch.
constexpr int kOriginAtSwitch = 8;
constexpr char kForceOrigin = 'Z';

constexpr std::array kAxes = {'X', 'Y', 'Z'};

/// Up to three decimals: 12.5, 23000.
std::string number(double value) { return trimmed_decimal(value, 3); }

std::string setting_text(int number_of, double value) {
  return std::string("$").append(std::to_string(number_of)).append("=").append(number(value));
}

bool homing_on(const ControllerInfo& info) {
  return (static_cast<int>(info.setting(22).value_or(0.0)) & 1) != 0;
}

bool origin_at_switch(const ControllerInfo& info) {
  const int mask = static_cast<int>(info.setting(22).value_or(0.0));
  return info.options.find(kForceOrigin) != std::string::npos || (mask & kOriginAtSwitch) != 0;
}

/// "line 5 has", "line 5 and 2 more have"
std::string where_text(const MarkedLines& lines) {
  const std::string first = "line " + std::to_string(lines.first);
  if (lines.count == 1) return first + " has";
  return first + " and " + std::to_string(lines.count - 1) + " more have";
}

void check_spindle(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  const std::optional<double> most = info.setting(30);
  const std::optional<double> least = info.setting(31);
  if (most && facts.top_rpm > *most) {
    found.refusals.push_back("line " + std::to_string(facts.top_rpm_line) + " asks for S" +
                             number(facts.top_rpm) + ", but the controller turns at most " +
                             setting_text(30, *most) + " and would clamp it silently");
  }
  if (least && facts.least_rpm < *least) {
    found.refusals.push_back("the program commands S" + number(facts.least_rpm) +
                             ", but the controller turns at least " + setting_text(31, *least));
  }
  if (info.setting(32).value_or(0.0) == 1.0) {
    found.refusals.emplace_back(
        "$32=1: the controller is in laser mode, where a spindle is not waited for; set $32=0");
  }
}

void check_travel(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  const std::optional<Eigen::AlignedBox3d> box = travel_box(info);
  if (!box || facts.extent.isEmpty()) return;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double low = facts.extent.min()[k];
    const double high = facts.extent.max()[k];
    if (low >= box->min()[k] - kTravelTolerance && high <= box->max()[k] + kTravelTolerance) {
      continue;
    }
    const int setting = 130 + static_cast<int>(k);
    const char axis = kAxes[static_cast<std::size_t>(k)];
    found.refusals.push_back(std::string("the program moves ") + axis + " from " + number(low) +
                             " to " + number(high) + " mm in machine coordinates, the machine " +
                             "from " + number(box->min()[k]) + " to " + number(box->max()[k]) +
                             " (" + setting_text(setting, *info.setting(setting)) + ")");
  }
}

void check_state(const ControllerInfo& info, Findings& found) {
  const bool homed = info.status.homed.value_or(true);
  if (info.status.state == ReportedState::kAlarm || (homing_on(info) && !homed)) {
    found.refusals.emplace_back(
        "the machine is not homed, or in alarm: home it with --home (or $H) first");
  } else if (info.status.state != ReportedState::kIdle) {
    found.refusals.push_back("the controller is in state " +
                             std::string(state_name(info.status.state)) + "; it must be Idle");
  }
  if (homing_on(info) && !travel_box(info)) {
    found.warnings.emplace_back(
        "the controller reports no travel ($130-$132): the program's range is not checked");
  }
  if (!homing_on(info)) {
    found.warnings.emplace_back(
        "$22=0: homing is off, so travel is not checked and nothing can be resumed after a fault");
  }
}

void check_reports(const ControllerInfo& info, Findings& found) {
  if (!info.reports_room) {
    found.warnings.emplace_back("the controller does not report its buffers (Bf:, see $10)");
  }
  if (!info.line_numbers) {
    found.warnings.push_back(
        "the controller does not report line numbers (Ln:): the last line carried out is only "
        "known to " +
        std::to_string(info.planner_blocks + LineTracker::kStepLag + 1) + " motions");
  }
}

void check_feeds(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  double fastest = 0.0;
  for (const int setting : {110, 111, 112}) {
    fastest = std::max(fastest, info.setting(setting).value_or(0.0));
  }
  if (fastest > 0.0 && facts.top_feed > fastest) {
    found.warnings.push_back("line " + std::to_string(facts.top_feed_line) + " asks for F" +
                             number(facts.top_feed) + " mm/min, faster than any axis ($110-$112)");
  }
  if (facts.time.stream_limited()) {
    found.warnings.push_back("this path cannot be fed at this feed: around line " +
                             std::to_string(facts.time.peak_line) + " it needs " +
                             number(std::round(facts.time.peak_lines_per_second)) +
                             " lines/s and " +
                             number(std::round(facts.time.peak_bytes_per_second)) +
                             " bytes/s; the machine will stutter, and the job take " +
                             number(std::round(facts.time.stream_limited_seconds)) +
                             " s instead of " + number(std::round(facts.time.seconds)) + " s");
  }
}

}  // namespace

std::optional<Eigen::AlignedBox3d> travel_box(const ControllerInfo& info) {
  if (!homing_on(info)) return std::nullopt;
  const int inverted = static_cast<int>(info.setting(23).value_or(0.0));
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero());
  for (int k = 0; k < 3; ++k) {
    const double travel = info.setting(130 + k).value_or(0.0);
    if (travel <= 0.0) return std::nullopt;
    const bool positive = origin_at_switch(info) && (inverted >> k & 1) != 0;
    (positive ? box.max() : box.min())[k] = positive ? travel : -travel;
  }
  return box;
}

std::vector<std::string> program_warnings(const ProgramFacts& facts) {
  std::vector<std::string> warnings;
  if (facts.leaves_spindle_on) {
    warnings.emplace_back("the program ends with the spindle on: it has no M5 after its last cut");
  }
  if (!facts.ends) warnings.emplace_back("the program has no end (M2 or M30)");
  if (facts.unsafe_comments.count > 0) {
    warnings.push_back(where_text(facts.unsafe_comments) +
                       " a comment with bytes on which a controller acts, or that are no text; "
                       "comments are never sent");
  }
  if (facts.bare_circles.count > 0) {
    warnings.push_back(where_text(facts.bare_circles) +
                       " a circle without an end, which the Grbl family refuses; it is sent with "
                       "the coordinates of where the tool stands");
  }
  return warnings;
}

Findings check_program(const ProgramFacts& facts, const ControllerInfo& info) {
  Findings found;
  check_state(info, found);
  check_spindle(facts, info, found);
  check_travel(facts, info, found);
  check_feeds(facts, info, found);
  check_reports(info, found);
  for (std::string& warning : program_warnings(facts)) {
    found.warnings.push_back(std::move(warning));
  }
  if (info.dialect.spindle_by_hand) {
    found.warnings.emplace_back(
        "the spindle is switched by hand: nothing verifies that it turns before a cut");
  }
  return found;
}

void check_spindle_range(const ProgramFacts& facts, const std::vector<RegisterMap>& maps,
                         Findings& found) {
  for (const RegisterMap& map : maps) {
    if (!map.spindle || facts.top_rpm <= 0.0) continue;
    const double least = map.spindle->rpm_min;
    const double most = map.spindle->rpm_max;
    if (facts.least_rpm >= least && facts.top_rpm <= most) continue;
    const double wrong = facts.top_rpm > most ? facts.top_rpm : facts.least_rpm;
    found.refusals.push_back("the program commands S" + number(wrong) + ", but the register map " +
                             map.name + " turns at " + number(least) + " to " + number(most) +
                             " rpm");
  }
}

std::string lack_of_motion(const ProgramFacts& facts) {
  if (facts.motions > 0) return {};
  const std::string advice = "; send a program with motion, such as one that cam wrote";
  if (facts.lines == 0) return "is empty" + advice;
  const std::string lines = "its " + std::to_string(facts.lines) + " lines";
  if (facts.sent_lines == 0) return lines + " hold no command" + advice;
  return lines + (facts.ends ? " up to its end (M2, M30 or %)" : "") +
         " contain no motion: none has G0, G1, G2 or G3 with X, Y or Z" + advice;
}

StreamRate stream_rate(const ControllerInfo& info, int baud, double round_trip, double mean_bytes) {
  StreamRate rate;
  if (baud > 0) rate.bytes_per_second = baud / kBitsPerByte;
  rate.lines_per_second = info.dialect.lines_per_second;
  if (round_trip > 0.0) {
    const double transfer = baud > 0 ? mean_bytes / rate.bytes_per_second : 0.0;
    rate.lines_per_second = std::min(rate.lines_per_second, 1.0 / (round_trip + transfer));
  }
  return rate;
}

}  // namespace lensforge
