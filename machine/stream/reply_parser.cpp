// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/reply_parser.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr std::size_t kMaxAxes = 8;
constexpr std::size_t kLongestState = 12;

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

/// Maximum position, mm or inches, and speed; a larger number was garbled.
constexpr int kLargestReading = 1'000'000'000;

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
  if (std::is_floating_point_v<Number> && !(std::abs(value) <= Number{kLargestReading})) {
    return std::nullopt;
  }
  return value;
}

/// "1,2,3" → numbers; empty if one is none.
template <class Number>
std::vector<Number> numbers(std::string_view text) {
  std::vector<Number> values;
  for (const std::string_view word : split(text, ',')) {
    const auto value = number<Number>(word);
    if (!value || values.size() >= kMaxAxes) return {};
    values.push_back(*value);
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
  return !text.empty() && text.size() <= kLongestState && text.front() >= 'A' &&
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
  const std::string_view inside = line.substr(1, line.size() - 2);
  if (inside.find_first_of("<>") != std::string_view::npos) return std::nullopt;
  StatusReport report;
  std::vector<std::string_view> names;
  for (const std::string_view field : split(inside, '|')) {
    const bool first = names.empty();
    if (!(first ? read_state(field, report) : read_field(field, report))) return std::nullopt;
    const std::string_view name = field.substr(0, field.find(':'));
    if (std::find(names.begin(), names.end(), name) != names.end()) return std::nullopt;
    names.push_back(name);
  }
  if (report.machine_position.has_value() == report.work_position.has_value()) return std::nullopt;
  return report;
}

// Numbers as documented for Grbl 1.1 (1 to 38, alarms 1 to 9) and grblHAL (the rest, which gives 5,
// 9, 18 and 19 much the same meaning).
namespace {

struct Code {
  int number;
  std::string_view meaning;
};

constexpr std::array kErrors = std::to_array<Code>({
    {1, "a word does not begin with a letter"},
    {2, "a number is missing or malformed"},
    {3, "unknown $ command"},
    {4, "a value must not be negative"},
    {5, "homing is switched off ($22)"},
    {6, "the step pulse is too short ($0)"},
    {7, "the stored settings could not be read and were reset"},
    {8, "this command is only taken while the machine is idle"},
    {9, "locked: alarm or jogging; home the machine ($H) or unlock it ($X)"},
    {10, "soft limits need homing to be switched on"},
    {11, "the line is too long"},
    {12, "the setting asks for more steps per second than possible"},
    {13, "the safety door is open"},
    {14, "the stored line is too long"},
    {15, "the jog would leave the machine's travel"},
    {16, "malformed jog command"},
    {17, "laser mode needs a spindle output with PWM"},
    {18, "a reset was asserted"},
    {19, "a value must be above zero"},
    {20, "unsupported or invalid G-code"},
    {21, "two words of one modal group in a line"},
    {22, "no feed has been set"},
    {23, "a word needs an integer"},
    {24, "two words that both use the axis words"},
    {25, "a word is given twice in a line"},
    {26, "axis words are missing"},
    {27, "line number out of range"},
    {28, "a P or L word is missing"},
    {29, "this work coordinate system is not supported"},
    {30, "G53 needs G0 or G1"},
    {31, "axis words that nothing uses"},
    {32, "an arc without axis words in its plane"},
    {33, "the target of the motion is invalid"},
    {34, "the radius of an arc is invalid"},
    {35, "an arc without offsets in its plane"},
    {36, "words that nothing uses"},
    {37, "a tool length offset on another axis than the tool's"},
    {38, "tool number too large"},
    {39, "a value is out of range"},
    {40, "a tool change is pending"},
    {41, "the spindle does not turn"},
    {42, "this plane is not allowed here"},
    {43, "feed above the machine's maximum"},
    {44, "spindle speed out of range"},
    {45, "a limit switch is engaged"},
    {46, "the machine must be homed first"},
    {47, "tool error"},
    {48, "conflicting words"},
    {49, "the self-test failed"},
    {50, "the emergency stop is active"},
    {51, "a motor driver reports a fault"},
    {52, "setting out of range"},
    {53, "the setting is not available"},
    {54, "invalid retract position"},
    {55, "homing is set up wrongly"},
    {56, "the coordinate system is locked"},
    {57, "file demarcation in an unexpected place"},
    {58, "the auxiliary port is not available"},
    {60, "the SD card cannot be mounted"},
    {61, "the file cannot be read"},
    {62, "the folder cannot be opened"},
    {63, "no such folder"},
    {64, "no SD card is mounted"},
    {65, "no file system is mounted"},
    {66, "the file system is read-only"},
    {70, "Bluetooth could not be started"},
    {71, "unknown operation in an expression"},
    {77, "a password is required"},
    {78, "access denied"},
    {79, "not allowed while a critical event is active"},
    {81, "malformed flow control"},
});

constexpr std::array kAlarms = std::to_array<Code>({
    {1, "a limit switch was hit; the position is lost, home the machine"},
    {2, "the target is outside the machine's travel; the position is still known"},
    {3, "reset while in motion; the position is lost, home the machine"},
    {4, "the probe was not in its initial state"},
    {5, "the probe found nothing"},
    {6, "homing was reset"},
    {7, "the safety door was opened during homing"},
    {8, "homing could not leave the limit switch"},
    {9, "homing did not find the limit switch"},
    {10, "the emergency stop is active"},
    {11, "the machine must be homed"},
    {12, "a limit switch is engaged"},
    {13, "the probe protection was triggered"},
    {14, "the spindle did not reach its speed or failed"},
    {15, "homing did not find the second switch of a ganged axis"},
    {16, "the self-test failed"},
    {17, "a motor driver reports a fault"},
    {18, "homing failed"},
});

std::string explained(const std::string& name, int number, std::span<const Code> codes) {
  const auto found = std::find_if(codes.begin(), codes.end(),
                                  [&](const Code& code) { return code.number == number; });
  const std::string meaning =
      found == codes.end() ? "a number that is not documented" : std::string(found->meaning);
  return name + ":" + std::to_string(number) + ": " + meaning;
}

}  // namespace

std::string explain_error(int code) { return explained("error", code, kErrors); }

std::string explain_alarm(int code) { return explained("ALARM", code, kAlarms); }

namespace {

constexpr int kLastCode = 255;

bool printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= ' ' && c < 127; });
}

bool digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return c >= '0' && c <= '9'; });
}

/// A number as the controllers write it: digits alone, no zero in front, 1 to 255.
std::optional<int> code_after(std::string_view line, std::string_view prefix) {
  if (!line.starts_with(prefix)) return std::nullopt;
  const std::string_view text = line.substr(prefix.size());
  int code = 0;
  if (!digits(text) || text.front() == '0' || text.size() > 3) return std::nullopt;
  std::from_chars(text.data(), text.data() + text.size(), code);
  return code <= kLastCode ? std::optional(code) : std::nullopt;
}

/// "[NAME:value]"; MSG is a kind of its own.
bool read_bracketed(std::string_view line, Reply& reply) {
  if (line.size() < 3 || line.front() != '[' || line.back() != ']') return false;
  const std::string_view inside = line.substr(1, line.size() - 2);
  const std::size_t colon = inside.find(':');
  const std::string_view name = inside.substr(0, colon);
  if (colon == std::string_view::npos || name.empty() || !printable(inside)) return false;
  if (name.find_first_of(" []<>|") != std::string_view::npos) return false;
  reply.kind = name == "MSG" ? Reply::Kind::kMessage : Reply::Kind::kData;
  reply.name = name;
  reply.value = inside.substr(colon + 1);
  return true;
}

/// "$110=500.000" or "$N0=G54".
bool read_setting(std::string_view line, Reply& reply) {
  const std::size_t equals = line.find('=');
  if (line.size() < 3 || line.front() != '$' || equals == std::string_view::npos) return false;
  const std::string_view name = line.substr(1, equals - 1);
  if (!digits(name.starts_with('N') ? name.substr(1) : name)) return false;
  reply.kind = Reply::Kind::kSetting;
  reply.name = name;
  reply.value = line.substr(equals + 1);
  return true;
}

bool is_banner(std::string_view line) {
  return line.starts_with("Grbl") && line.ends_with("for help]") &&
         line.find(" [") != std::string_view::npos;
}

/// ">G54G20:ok", or with the error that the stored line makes.
bool is_startup_line(std::string_view line) {
  if (!line.starts_with('>')) return false;
  const std::size_t error = line.rfind(":error:");
  return line.ends_with(":ok") ||
         (error != std::string_view::npos && code_after(line.substr(error), ":error:"));
}

bool read_code(std::string_view line, std::string_view prefix, Reply::Kind kind, Reply& reply) {
  const std::optional<int> code = code_after(line, prefix);
  if (!code) return false;
  reply.kind = kind;
  reply.code = *code;
  return true;
}

}  // namespace

Reply parse_reply(std::string_view line) {
  Reply reply;
  reply.text = line;
  if (line == "ok") {
    reply.kind = Reply::Kind::kOk;
    return reply;
  }
  if (line.empty()) reply.kind = Reply::Kind::kEmpty;
  if (line.empty() || !printable(line)) return reply;
  if (read_code(line, "error:", Reply::Kind::kError, reply) ||
      read_code(line, "ALARM:", Reply::Kind::kAlarm, reply) || read_bracketed(line, reply) ||
      read_setting(line, reply)) {
    return reply;
  }
  reply.status = parse_status_report(line);
  if (reply.status) reply.kind = Reply::Kind::kStatus;
  if (is_banner(line)) reply.kind = Reply::Kind::kBanner;
  if (is_startup_line(line)) reply.kind = Reply::Kind::kStartup;
  return reply;
}

void ReplyReader::feed(std::string_view bytes, const std::function<void(const Reply&)>& take) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, end);
    const std::size_t room = kLongestLine - line_.size();
    line_.append(piece.substr(0, room));
    too_long_ = too_long_ || piece.size() > room;
    if (end == std::string_view::npos) return;
    bytes.remove_prefix(end + 1);
    // Handed on from a copy: the taker may start afresh, which clears the line.
    std::string line;
    line.swap(line_);
    if (line.ends_with('\r')) line.pop_back();
    Reply reply = too_long_ ? Reply{} : parse_reply(line);
    if (too_long_) reply.text = line;
    too_long_ = false;
    take(reply);
  }
}

}  // namespace lensforge
