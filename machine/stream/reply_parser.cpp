// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/reply_parser.h"

#include <algorithm>
#include <charconv>

#include "core/error.h"

namespace lensforge {
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
