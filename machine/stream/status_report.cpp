// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/status_report.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace lensforge {
namespace {

constexpr std::size_t kMaxAxes = 8;
constexpr std::size_t kLongestName = 12;

constexpr std::array<std::pair<std::string_view, ReportedState>, 10> kStates{
    {{"Idle", ReportedState::kIdle},
     {"Run", ReportedState::kRun},
     {"Hold", ReportedState::kHold},
     {"Jog", ReportedState::kJog},
     {"Alarm", ReportedState::kAlarm},
     {"Door", ReportedState::kDoor},
     {"Check", ReportedState::kCheck},
     {"Home", ReportedState::kHome},
     {"Sleep", ReportedState::kSleep},
     {"Tool", ReportedState::kTool}}};

/// Of positions, mm or inches, and speeds: what is more was garbled.
constexpr int kLargestNumber = 1'000'000'000;

/// A field being read: whether it is as it should be.
using Parse = bool (*)(std::string_view, StatusReport&);

/// Digits, one point, a sign: nothing that from_chars() takes beyond that (inf, exponents).
bool plain_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("-.0123456789") == std::string_view::npos;
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (!plain_number(text) || error != std::errc() || stopped != end) return std::nullopt;
  if (std::is_floating_point_v<Number> && !(std::abs(value) <= Number{kLargestNumber})) {
    return std::nullopt;
  }
  return value;
}

/// "1,2,3" → numbers; empty if one is none.
template <class Number>
std::vector<Number> numbers(std::string_view text) {
  std::vector<Number> values;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const auto value = number<Number>(text.substr(begin, comma - begin));
    if (!value || values.size() >= kMaxAxes) return {};
    values.push_back(*value);
    begin = comma + 1;
  }
  return values;
}

/// X, Y and Z; further axes are passed over.
bool read_axes(std::string_view text, std::optional<Eigen::Vector3d>& axes) {
  const std::vector<double> values = numbers<double>(text);
  if (values.size() < 3) return false;
  axes = Eigen::Vector3d(values[0], values[1], values[2]);
  return true;
}

bool read_room(std::string_view text, StatusReport& report) {
  const std::vector<int> values = numbers<int>(text);
  if (values.size() != 2 || values[0] < 0 || values[1] < 0) return false;
  report.room = BufferRoom{values[0], values[1]};
  return true;
}

bool read_line(std::string_view text, StatusReport& report) {
  report.line = number<std::int64_t>(text);
  return report.line && *report.line >= 0;
}

bool read_feed(std::string_view text, StatusReport& report) {
  report.feed = number<double>(text);
  return report.feed.has_value();
}

bool read_feed_and_speed(std::string_view text, StatusReport& report) {
  const std::vector<double> values = numbers<double>(text);
  if (values.size() != 2 && values.size() != 3) return false;
  report.feed = values[0];
  report.spindle_rpm = values[1];
  if (values.size() == 3) report.measured_rpm = values[2];
  return true;
}

bool read_overrides(std::string_view text, StatusReport& report) {
  const std::vector<int> values = numbers<int>(text);
  if (values.size() != 3) return false;
  report.overrides = Eigen::Vector3i(values[0], values[1], values[2]);
  return true;
}

bool capitals(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
}

/// H:0, H:1 and H:1,7 (with the homed axes as a mask).
bool read_homed(std::string_view text, StatusReport& report) {
  const std::vector<int> values = numbers<int>(text);
  if (values.empty() || values.size() > 2 || (values[0] != 0 && values[0] != 1)) return false;
  report.homed = values[0] == 1;
  return true;
}

struct Field {
  std::string_view name;
  Parse parse;
};

constexpr std::array<Field, 11> kFields{{
    {"MPos", [](auto text, auto& report) { return read_axes(text, report.machine_position); }},
    {"WPos", [](auto text, auto& report) { return read_axes(text, report.work_position); }},
    {"WCO", [](auto text, auto& report) { return read_axes(text, report.work_offset); }},
    {"Bf", read_room},
    {"Ln", read_line},
    {"F", read_feed},
    {"FS", read_feed_and_speed},
    {"Pn",
     [](auto text, auto& report) {
       report.pins = text;
       return !text.empty() && capitals(text);
     }},
    {"Ov", read_overrides},
    {"A",
     [](auto text, auto& report) {
       report.accessories = text;
       return capitals(text);
     }},
    {"H", read_homed},
}};

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName && text.front() >= 'A' &&
         text.front() <= 'Z' && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
         });
}

bool read_state(std::string_view text, StatusReport& report) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto* const found = std::find_if(kStates.begin(), kStates.end(), [&](const auto& entry) {
    return entry.first == text.substr(0, colon);
  });
  if (found == kStates.end()) return false;
  report.state = found->second;
  if (colon == text.size()) return true;
  report.sub_state = number<int>(text.substr(colon + 1));
  return report.sub_state && *report.sub_state >= 0;
}

bool read_field(std::string_view text, StatusReport& report) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string_view name = text.substr(0, colon);
  if (!is_name(name)) return false;
  const auto* const known = std::find_if(kFields.begin(), kFields.end(),
                                         [&](const Field& field) { return field.name == name; });
  if (known != kFields.end()) {
    return colon < text.size() && known->parse(text.substr(colon + 1), report);
  }
  report.others.emplace_back(text);
  return true;
}

}  // namespace

std::string_view state_name(ReportedState state) {
  for (const auto& [name, value] : kStates) {
    if (value == state) return name;
  }
  return {};
}

std::optional<StatusReport> parse_status_report(std::string_view line) {
  if (line.size() < 2 || line.front() != '<' || line.back() != '>') return std::nullopt;
  std::string_view rest = line.substr(1, line.size() - 2);
  if (rest.find_first_of("<>") != std::string_view::npos) return std::nullopt;
  StatusReport report;
  std::vector<std::string_view> names;
  for (bool first = true; first || !rest.empty(); first = false) {
    const std::size_t bar = std::min(rest.find('|'), rest.size());
    const std::string_view field = rest.substr(0, bar);
    if (!(first ? read_state(field, report) : read_field(field, report))) return std::nullopt;
    const std::string_view name = field.substr(0, field.find(':'));
    if (std::find(names.begin(), names.end(), name) != names.end()) return std::nullopt;
    names.push_back(name);
    if (bar + 1 == rest.size()) return std::nullopt;  // An empty field at the end.
    rest.remove_prefix(std::min(bar + 1, rest.size()));
  }
  if (report.machine_position.has_value() == report.work_position.has_value()) return std::nullopt;
  return report;
}

}  // namespace lensforge
