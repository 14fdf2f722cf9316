// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/oracles.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string_view>

namespace lensforge::fuzz {
namespace {

using Texts = std::vector<std::string>;

/// A message of 1,000 bytes, the program's name and an end of line, with some room.
constexpr std::size_t kLongestLine = 1100;

/// What libraries say and no user should read.
constexpr std::array kRawTexts{
    "vector::",  "basic_string", "[json.exception", "std::",     "terminate called",
    "Standard_", "libpng",       "TIFFRead",        "bad_alloc", "_M_",
    "StdFail_",  "[ERROR]",      "[WARNING]",       "OpenMesh",  "stack smashing",
    "free(): ",  "malloc(): ",   "a bug",           "Assertion"};

bool has_option(const Command& command, const char* option) {
  const Arguments& words = command.arguments;
  return std::find(words.begin(), words.end(), option) != words.end();
}

/// The bytes of one UTF-8 character at `at`; 0 if it is none.
std::size_t character_size(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(at);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC2 ? 2 : 0;
  if (size == 0 || first > 0xF4 || at + size > text.size()) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(at + i) & 0xC0U) != 0x80U) return 0;
  }
  const std::uint8_t second = byte(at + 1);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second > 0x9F;
  return overlong || surrogate || (first == 0xF4 && second > 0x8F) ? 0 : size;
}

/// Nothing in it moves a cursor, rings a bell or is no text at all. Line feeds are.
bool printable(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = character_size(text, at);
    if (size == 0) return false;
    const auto byte = static_cast<std::uint8_t>(text[at]);
    if (size == 1 && (byte < 0x20 || byte == 0x7F) && byte != '\n') return false;
    if (size == 2 && byte == 0xC2 && static_cast<std::uint8_t>(text[at + 1]) < 0xA0) return false;
    at += size;
  }
  return true;
}

Texts lines_of(const std::string& text) {
  Texts lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string shown(const std::string& text) {
  std::string cut = text.substr(0, 200);
  std::replace_if(
      cut.begin(), cut.end(), [](char c) { return c < ' ' || c == 127; }, '?');
  return "\"" + cut + "\"";
}

bool shows_json(const Command& command, const Ending& ending) {
  for (const char* other : {"--help", "--help-all", "-h", "--version", "--show-workshop"}) {
    if (ending.exit_code == 0 && has_option(command, other)) return false;
  }
  const bool asked = command.json_by_config || has_option(command, "--json");
  return asked && command.out == Stream::kUsual;
}

void check_text(const std::string& where, const std::string& text, Texts& wrong) {
  if (!printable(text)) wrong.push_back(where + " is not printable: " + shown(text));
  for (const char* raw : kRawTexts) {
    if (text.find(raw) != std::string::npos) {
      wrong.push_back(where + " has raw text, " + raw + ": " +
                      shown(text.substr(std::max<std::size_t>(text.find(raw), 60) - 60)));
    }
  }
}

void check_json(const Command& command, const Ending& ending, Texts& wrong) {
  const bool cut_short = ending.exit_code == 1 && command.file_size_limit > 0;
  if (!shows_json(command, ending) || cut_short) return;
  const auto json = nlohmann::json::parse(ending.out, nullptr, false);
  if (!json.is_object()) {
    wrong.push_back("--json printed no object: " + shown(ending.out));
  } else if (ending.exit_code == 2 &&
             (json.value("exit_code", 0) != 2 || !json.contains("error"))) {
    wrong.push_back("--json says nothing of the error: " + shown(ending.out));
  }
}

void check_refusal(const Command& command, const Ending& ending, Texts& wrong) {
  if (!shows_json(command, ending) && !ending.out.empty()) {
    wrong.push_back("a refusal prints on standard output: " + shown(ending.out));
  }
  if (command.err != Stream::kUsual) return;
  Texts lines = lines_of(ending.err);
  // What an operator is told before the machine accepts a job.
  const auto is_told = [](const std::string& line) {
    return line.starts_with("lensforge: warning: ") || line.starts_with("lensforge: resume: ") ||
           line.starts_with("lensforge: the last run ended: ");
  };
  if (!command.arguments.empty() && command.arguments.front() == "send") {
    lines.erase(std::remove_if(lines.begin(), lines.end(), is_told), lines.end());
  }
  if (lines.size() != 1) {
    wrong.push_back("a refusal of " + std::to_string(lines.size()) +
                    " lines: " + shown(ending.err));
  } else if (!lines.front().starts_with("lensforge: ")) {
    wrong.push_back("a refusal that does not begin with the program: " + shown(ending.err));
  }
}

/// A signal that the command has not yet taken over ends it: it has done nothing so far.
bool ended_as_asked(const Ending& ending) {
  return ending.asked != 0 && ending.signal == ending.asked;
}

std::string cause_of_failure(const Ending& ending) { return shown(ending.err); }

/// Full disks and memory are the world's doing wherever they are met.
bool names_the_world(const Ending& ending) {
  for (const char* cause : {"not enough memory", "File too large", "No space left"}) {
    if (ending.err.find(cause) != std::string::npos) return true;
  }
  return false;
}

void check_code(const Plan& plan, const Ending& ending, Texts& wrong) {
  static const std::set<int> kCodes{0, 1, 2, 3, 130};
  const int code = ending.exit_code;
  if (!kCodes.contains(code)) wrong.push_back("exit code " + std::to_string(code));
  if (code == 130 && ending.asked == 0) wrong.emplace_back("exit code 130 without a signal");
  if (code == 1 && !plan.may_fail && !names_the_world(ending)) {
    wrong.push_back("exit code 1 where nothing around it failed: " + cause_of_failure(ending));
  }
  if (plan.must_refuse && code != 2 && ending.asked == 0) {
    wrong.push_back("exit code " + std::to_string(code) + " for what has to be refused");
  }
  if (plan.must_work && code != 0 && code != 3 && ending.asked == 0) {
    wrong.push_back("exit code " + std::to_string(code) +
                    " for what is good: " + cause_of_failure(ending));
  }
}

bool lies_in(const std::string& path, const Texts& places) {
  return std::any_of(places.begin(), places.end(), [&](const std::string& place) {
    if (place == "./") return true;
    return place.ends_with('/') ? (path + "/").starts_with(place) : path == place;
  });
}

/// Folders above a place appear with it.
bool leads_to(const std::string& path, const Texts& places) {
  return std::any_of(places.begin(), places.end(),
                     [&](const std::string& place) { return place.starts_with(path + "/"); });
}

bool is_partial(const std::string& path) { return path.find(".partial-") != std::string::npos; }

/// Whether the difference is the command's right.
bool allowed(const Plan& plan, const Difference& difference, bool refused, bool broken_off) {
  const std::string& path = difference.path;
  const bool grows = difference.kind == Difference::Kind::kNew ||
                     (difference.kind == Difference::Kind::kChanged && plan.ours.contains(path));
  if (lies_in(path, plan.logs) && grows) return true;
  if (refused) return false;
  if (difference.kind == Difference::Kind::kNew) {
    if (is_partial(path) && !broken_off) return false;
    return lies_in(path, plan.outputs) || (difference.folder && leads_to(path, plan.outputs));
  }
  if (plan.forced.contains(path)) return true;
  const bool own = plan.ours.contains(path) || difference.folder;
  return own && lies_in(path, plan.outputs);
}

/// An old lens may be replaced by a whole new one, and by nothing else.
void check_lens(const Plan& plan, const Snapshot& before, const Snapshot& after, Texts& wrong) {
  const std::string json = plan.lens + "/lens.json";
  if (plan.lens.empty() || !before.contains(json)) return;
  const auto now = after.find(json);
  if (now == after.end()) {
    wrong.push_back("the old lens is lost: gone " + json);
    return;
  }
  if (!(now->second == before.at(json))) return;
  const std::string cut = plan.lens + "/cam/";
  const bool cuts = std::find(plan.outputs.begin(), plan.outputs.end(), cut) != plan.outputs.end();
  for (const auto& [path, entry] : before) {
    const auto kept = after.find(path);
    if (cuts && path.starts_with(cut)) continue;
    if (!path.starts_with(plan.lens + "/") || !plan.ours.contains(path)) continue;
    if (kept == after.end() || !(kept->second == entry)) {
      wrong.push_back("lens.json is the old one, but not " + path);
    }
  }
}

}  // namespace

std::vector<std::string> wrong_endings(const Plan& plan, const Command& command,
                                       const Ending& ending) {
  Texts wrong;
  if (ending.killed) {
    wrong.push_back("did not stop within " + std::to_string(kMaxStop) + " s of a signal");
    return wrong;
  }
  check_text("standard error", ending.err, wrong);
  check_text("standard output", ending.out, wrong);
  for (const std::string& finding : plan.must_not_say) {
    if (ending.err.find(finding) != std::string::npos) wrong.push_back("says \"" + finding + "\"");
  }
  for (const std::string& line : lines_of(ending.err)) {
    if (line.size() > kLongestLine) {
      wrong.push_back("a line of " + std::to_string(line.size()) + " bytes: " + shown(line));
    }
  }
  if (plan.must_refuse && ending.asked != 0 && plan.interrupt_after <= 0.0) {
    wrong.emplace_back("still running for what has to be refused");
  }
  if (ended_as_asked(ending)) return wrong;
  if (ending.signal != 0) {
    wrong.push_back("ended by signal " + std::to_string(ending.signal) + " (" +
                    strsignal(ending.signal) + "): " + shown(ending.err));
    return wrong;
  }
  check_code(plan, ending, wrong);
  check_json(command, ending, wrong);
  if (ending.exit_code == 2) check_refusal(command, ending, wrong);
  return wrong;
}

std::vector<std::string> wrong_files(const Plan& plan, const std::vector<Ending>& endings,
                                     const Snapshot& before, const Snapshot& after) {
  const auto refused = [](const Ending& ending) { return ending.exit_code == 2; };
  const auto broken_off = [](const Ending& ending) { return ending.exit_code < 0; };
  const bool all_refused = std::all_of(endings.begin(), endings.end(), refused);
  const bool any_broken_off = std::any_of(endings.begin(), endings.end(), broken_off);
  Texts wrong;
  for (const Difference& difference : differences(before, after)) {
    if (allowed(plan, difference, all_refused, any_broken_off)) continue;
    wrong.push_back((all_refused ? "refused, but " : "") + words(difference));
  }
  check_lens(plan, before, after, wrong);
  return wrong;
}

}  // namespace lensforge::fuzz
