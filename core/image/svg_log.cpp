// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

#include "core/error.h"
#include "core/text/lower_case.h"
#include "core/text/printable.h"

// With RSVG_LOG in its environment librsvg prints, on standard output,
//   Invalid declaration; ignoring: (ParseError { ... } }, "fill: var(--x);")
//   Invalid rule; ignoring: (ParseError { ... } }, "@media screen ")
//   (ignoring invalid presentation attribute fill
//       value="var(--x)"
//   (not rendering element circle id=a because it is in error)
//   could not resolve paint server "#a", no alternate color specified
// Quotes in the first two are escaped.
namespace lensforge {
namespace {

/// Maximum bytes of a file's name or value in a finding.
constexpr std::size_t kLongestValue = 60;

/// Maximum bytes examined per line.
constexpr std::size_t kLongestLine = std::size_t{64} << 10U;

/// Maximum kinds of findings: a file may cause a thousand.
constexpr std::size_t kMostKinds = 24;

struct Advice {
  std::string_view mark;
  const char* words;
};

constexpr const char* kPlainColour = "write the colour as #rrggbb";
constexpr const char* kPlainLength = "write the length itself, in px or mm";
constexpr const char* kClipElement = "use a clipPath element";
constexpr const char* kGradientElement = "use a gradient element";

/// Functions and units of values.
constexpr std::array<Advice, 39> kValueAdvice{{{"var", "write the value itself"},
                                               {"env", "write the value itself"},
                                               {"attr", "write the value itself"},
                                               {"calc", kPlainLength},
                                               {"min", kPlainLength},
                                               {"max", kPlainLength},
                                               {"clamp", kPlainLength},
                                               {"round", kPlainLength},
                                               {"rem", kPlainLength},
                                               {"ch", kPlainLength},
                                               {"vw", kPlainLength},
                                               {"vh", kPlainLength},
                                               {"vmin", kPlainLength},
                                               {"vmax", kPlainLength},
                                               {"q", kPlainLength},
                                               {"lh", kPlainLength},
                                               {"rlh", kPlainLength},
                                               {"cap", kPlainLength},
                                               {"oklch", kPlainColour},
                                               {"oklab", kPlainColour},
                                               {"lch", kPlainColour},
                                               {"lab", kPlainColour},
                                               {"hwb", kPlainColour},
                                               {"color", kPlainColour},
                                               {"color-mix", kPlainColour},
                                               {"light-dark", kPlainColour},
                                               {"device-cmyk", kPlainColour},
                                               {"icc-color", kPlainColour},
                                               {"polygon", kClipElement},
                                               {"circle", kClipElement},
                                               {"ellipse", kClipElement},
                                               {"inset", kClipElement},
                                               {"path", kClipElement},
                                               {"xywh", kClipElement},
                                               {"rect", kClipElement},
                                               {"linear-gradient", kGradientElement},
                                               {"radial-gradient", kGradientElement},
                                               {"conic-gradient", kGradientElement},
                                               {"url", "only one at a time is drawn"}}};

/// Pseudo-classes and pseudo-elements that never match in a still picture: a rule for them alone
/// has no effect.
constexpr std::array<std::string_view, 11> kNeverSeen{
    "hover",  "focus", "focus-visible", "focus-within", "active",   "target",
    "before", "after", "selection",     "visited",      "disabled",
};

template <std::size_t kCount>
const char* advice_for(const std::array<Advice, kCount>& table, std::string_view mark) {
  const auto found =
      std::find_if(table.begin(), table.end(), [&](const Advice& row) { return row.mark == mark; });
  return found == table.end() ? nullptr : found->words;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kAround = " \t\r\n;";
  const std::size_t begin = text.find_first_not_of(kAround);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kAround) - begin + 1);
}

std::string in_quotes(std::string_view text) {
  return "'" + printable_line(text, kLongestValue) + "'";
}

/// The text between `before` and `after`; empty if there is none.
std::string_view between(std::string_view text, std::string_view before, std::string_view after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string_view::npos) return {};
  text.remove_prefix(begin + before.size());
  return text.substr(0, text.find(after));
}

/// The last string of a line, without its escapes.
std::string last_string(std::string_view line) {
  constexpr std::string_view kBefore = " } }, \"";
  const std::size_t begin = line.find(kBefore);
  if (begin == std::string_view::npos) return {};
  line.remove_prefix(begin + kBefore.size());
  std::string text;
  for (std::size_t i = 0; i < line.size() && line[i] != '"'; ++i) {
    if (line[i] != '\\' || i + 1 == line.size()) {
      text += line[i];
    } else {
      const char escaped = line[++i];
      text += escaped == 'n' || escaped == 't' || escaped == 'r' ? ' ' : escaped;
    }
  }
  return text;
}

bool in_name(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '-'; }

/// The first function or unit in a value with advice, otherwise the first function.
std::string mark_of(std::string_view value) {
  std::string first;
  for (std::size_t i = 0; i < value.size();) {
    std::size_t end = i;
    while (end < value.size() && in_name(value[end])) ++end;
    std::string name = lower_case(std::string(value.substr(i, end - i)));
    const bool function = end < value.size() && value[end] == '(';
    const bool unit = i > 0 && std::isdigit(static_cast<unsigned char>(value[i - 1])) != 0;
    if (!name.empty() && (function || unit)) {
      if (advice_for(kValueAdvice, name) != nullptr) return name;
      if (function && first.empty()) first = name;
    }
    i = std::max(end, i + 1);
  }
  return first;
}

/// True for a list of coordinates, which SvgNeeds reports.
bool is_list_of_places(std::string_view name, std::string_view value) {
  return (name == "x" || name == "y") &&
         value.find_first_not_of("0123456789.,-+eE \t\r\npxtmc") == std::string_view::npos;
}

}  // namespace

void SvgLogReader::add(const std::string& kind, const std::string& finding) {
  if (findings_.size() < kMostKinds) findings_.emplace(kind, finding);
}

void SvgLogReader::take_value(std::string_view name, std::string_view value) {
  name = trimmed(name);
  value = trimmed(value);
  if (value.empty() || !std::all_of(name.begin(), name.end(), in_name)) return;
  if (is_list_of_places(name, value)) return;
  const std::string mark = mark_of(value);
  const char* const advice = advice_for(kValueAdvice, mark);
  const std::string text = std::string(name) + ": " + std::string(value);
  add("value " + (mark.empty() ? std::string(name) : mark),
      "left out " + in_quotes(text) + ": " +
          (advice != nullptr ? advice : "give it a value that SVG 1.1 knows"));
}

void SvgLogReader::take_declaration(std::string_view declaration) {
  if (declaration.find('{') != std::string_view::npos) {
    return add("nested", "left out the nested rule " + in_quotes(declaration) +
                             ": write it outside of the other");
  }
  const std::size_t colon = declaration.find(':');
  if (colon == std::string_view::npos) return;
  take_value(declaration.substr(0, colon), declaration.substr(colon + 1));
}

void SvgLogReader::take_rule(std::string_view error, std::string_view rule) {
  rule = trimmed(rule.substr(0, rule.find('{')));
  const std::string_view at = between(error, "AtRuleInvalid(\"", "\"");
  if (at == "font-face") {
    return add("font",
               "left out a font inside the file (@font-face): install it, or convert the "
               "text to paths");
  }
  if (at == "keyframes") {
    return add("animation", "left out animation (@keyframes): draw the moment that is meant");
  }
  if (!at.empty()) {
    return add("at-rule " + std::string(at),
               "left out the style rules of " + in_quotes(rule) + ": write them outside of it");
  }
  const std::string_view pseudo = between(error, "UnsupportedPseudoClassOrElement(\"", "\"");
  const bool never = std::find(kNeverSeen.begin(), kNeverSeen.end(), pseudo) != kNeverSeen.end();
  if (never && rule.find(',') == std::string_view::npos) return;
  add("rule " + std::string(pseudo),
      "left out the style rule of " + in_quotes(rule) + ": select by a class, such as .a");
}

void SvgLogReader::take_line(std::string_view line) {
  constexpr std::string_view kAttribute = "(ignoring invalid presentation attribute ";
  constexpr std::string_view kValue = "    value=\"";
  constexpr std::string_view kElement = "(not rendering element ";
  if (line.starts_with("Invalid declaration; ")) {
    if (line.find("Custom(UnknownProperty)") == std::string_view::npos) {
      take_declaration(last_string(line));
    }
  } else if (line.starts_with("Invalid rule; ")) {
    take_rule(line, last_string(line));
  } else if (line.starts_with(kAttribute)) {
    attribute_ = line.substr(kAttribute.size());
  } else if (line.starts_with(kValue)) {
    line.remove_prefix(kValue.size());
    take_value(attribute_, line.substr(0, line.rfind('"')));
  } else if (line.starts_with(kElement)) {
    const std::string_view name = between(line, kElement, " id=");
    add("element " + std::string(name), "left out an element '" + printable_line(name) +
                                            "', one of whose values is not understood: give it "
                                            "values that SVG 1.1 knows");
  } else if (line.starts_with("could not resolve paint server ")) {
    add("paint", "left out the paint " + in_quotes(between(line, "\"", "\"")) +
                     ", which is not understood or not in the file: give a colour");
  }
}

std::vector<std::string> SvgLogReader::findings() const {
  std::vector<std::string> all;
  for (const auto& [kind, finding] : findings_) all.push_back(finding);
  return all;
}

SvgLog::SvgLog() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw RunError("a pipe cannot be made");
  reading_ = Descriptor(ends[0]);
  const Descriptor writing(ends[1]);
  ::dup2(writing.number(), STDOUT_FILENO);
  ::setenv("RSVG_LOG", "1", 1);
  thread_ = std::thread([this] { read(); });
}

SvgLog::~SvgLog() { take(); }

void SvgLog::read() {
  std::string line;
  std::array<char, 4096> piece{};
  for (ssize_t got = 1; got != 0;) {
    got = ::read(reading_.number(), piece.data(), piece.size());
    if (got < 0 && errno != EINTR) return;
    for (ssize_t i = 0; i < got; ++i) {
      const char c = piece[static_cast<std::size_t>(i)];
      if (c == '\n') {
        reader_.take_line(line);
        line.clear();
      } else if (line.size() < kLongestLine) {
        line += c;
      }
    }
  }
}

std::vector<std::string> SvgLog::take() {
  if (thread_.joinable()) {
    // Closes the pipe's last writing end, standard output.
    const Descriptor nowhere(::open("/dev/null", O_WRONLY | O_CLOEXEC));
    ::dup2(nowhere.number(), STDOUT_FILENO);
    thread_.join();
  }
  return reader_.findings();
}

}  // namespace lensforge
