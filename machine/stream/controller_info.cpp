// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/controller_info.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kAnswerTimeout = 5.0;
constexpr std::array<std::string_view, 6> kSystems = {"G54", "G55", "G56", "G57", "G58", "G59"};

/// Bytes of the receive buffer that stay empty: rings cannot be filled wholly.
constexpr int kRingGap = 1;

/// No setting, size or position is larger; what is, or is no number, was garbled.
constexpr double kLargestNumber = 1e9;

std::vector<double> numbers(std::string_view text) {
  std::vector<double> values;
  while (!text.empty()) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !(std::abs(value) <= kLargestNumber)) return values;
    values.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.starts_with(',')) return values;
    text.remove_prefix(1);
  }
  return values;
}

void take_setting(const Reply& reply, ControllerInfo& info) {
  int number = 0;
  const char* end = reply.name.data() + reply.name.size();
  if (std::from_chars(reply.name.data(), end, number).ptr != end) return;
  const std::vector<double> values = numbers(reply.value);
  if (!values.empty()) info.settings[number] = values.front();
}

/// "VN,15,128": letters, planner blocks, bytes; grblHAL appends the number of axes.
void take_options(const std::string& value, ControllerInfo& info) {
  const std::size_t comma = std::min(value.find(','), value.size());
  info.options = value.substr(0, comma);
  info.line_numbers = info.options.find('N') != std::string::npos;
  if (comma == value.size()) return;
  const std::vector<double> sizes = numbers(std::string_view(value).substr(comma + 1));
  if (sizes.size() < 2 || sizes[0] < 1.0 || sizes[1] <= kRingGap) return;
  info.planner_blocks = static_cast<int>(sizes[0]);
  info.rx_bytes = static_cast<int>(sizes[1]) - kRingGap;
}

void take_build(const std::vector<Reply>& replies, ControllerInfo& info) {
  bool hal = info.banner.starts_with("GrblHAL");
  for (const Reply& reply : replies) {
    if (reply.name == "VER") info.version = reply.value;
    if (reply.name == "FIRMWARE") hal = hal || reply.value == "grblHAL";
  }
  info.dialect = hal ? grblhal_dialect() : grbl_dialect();
  info.rx_bytes = static_cast<int>(info.dialect.rx_bytes) - kRingGap;
  info.planner_blocks = info.dialect.planner_blocks;
  for (const Reply& reply : replies) {
    if (reply.name == "OPT") take_options(reply.value, info);
  }
}

/// [G54:…] … [G59:…], what shifts all of them (G92), and the tool's length, which G49 takes away.
void take_origins(const std::vector<Reply>& replies, ControllerInfo& info) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (const Reply& reply : replies) {
    const std::vector<double> values = numbers(reply.value);
    if (reply.name == "TLO" && !values.empty()) {
      info.start.stated_length = info.report_unit() * (values.size() < 3 ? values[0] : values[2]);
    }
    if (values.size() < 3) continue;
    const Eigen::Vector3d at =
        info.report_unit() * Eigen::Vector3d(values[0], values[1], values[2]);
    if (reply.name == "G92") shift += at;
    if (reply.name == "G28") info.start.g28 = at;
    if (reply.name == "G30") info.start.g30 = at;
    const auto* const system = std::find(kSystems.begin(), kSystems.end(), reply.name);
    if (system != kSystems.end()) {
      info.start.origins[static_cast<std::size_t>(system - kSystems.begin())] = at;
    }
  }
  for (Eigen::Vector3d& origin : info.start.origins) origin += shift;
}

void take_status(const StatusReport& report, ControllerInfo& info) {
  info.status = report;
  if (const auto at = info.machine_position(report)) info.start.position = *at;
  if (!report.room || !at_rest(report)) return;
  // Measured while empty, which is better than what it says of itself.
  info.reports_room = true;
  info.rx_bytes = report.room->bytes;
  info.planner_blocks = report.room->blocks;
}

}  // namespace

std::optional<double> ControllerInfo::setting(int number) const {
  const auto found = settings.find(number);
  return found == settings.end() ? std::nullopt : std::optional(found->second);
}

std::optional<Eigen::Vector3d> ControllerInfo::machine_position(const StatusReport& report) const {
  if (report.machine_position) return report_unit() * *report.machine_position;
  const auto& offset = report.work_offset ? report.work_offset : status.work_offset;
  if (!report.work_position || !offset) return std::nullopt;
  return report_unit() * (*report.work_position + *offset);
}

ControllerInfo learn_controller(Dialogue& dialogue, const std::string& banner) {
  ControllerInfo info;
  info.banner = banner;
  take_build(dialogue.ask("$I", kAnswerTimeout), info);
  for (const Reply& reply : dialogue.ask("$$", kAnswerTimeout)) {
    if (reply.kind == Reply::Kind::kSetting) take_setting(reply, info);
  }
  if (info.settings.empty()) {
    throw InputError("the controller reports no settings ($$); is it of the Grbl family?");
  }
  take_origins(dialogue.ask("$#", kAnswerTimeout), info);
  take_status(dialogue.status(), info);
  return info;
}

}  // namespace lensforge
