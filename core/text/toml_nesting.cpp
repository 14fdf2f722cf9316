// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/toml_nesting.h"

#include <algorithm>
#include <cstddef>

// tomlplusplus (3.3) makes a table for each part of a dotted key and destroys them by recursion: a
// key of 100,000 parts overflows the stack. TOML v1.0.0, "Keys", "String".
namespace lensforge {
namespace {

/// Scans a document, skipping strings and comments.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  std::optional<std::string> problem() {
    while (at_ < text_.size()) {
      step(text_[at_]);
      if (parts_ > kMaxTomlDepth) return line_text() + "a key has" + limit_text() + " parts";
      if (depth_ > kMaxTomlDepth)
        return line_text() + "brackets are nested" + limit_text() + " deep";
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] std::string line_text() const {
    const auto lines = std::count(text_.begin(), text_.begin() + static_cast<long>(at_), '\n');
    return "line " + std::to_string(lines + 1) + ": ";
  }
  static std::string limit_text() { return " more than " + std::to_string(kMaxTomlDepth); }

  void step(char c) {
    if (c == '"' || c == '\'') return skip_string(c);
    if (c == '#') return skip_to("\n");
    ++at_;
    if (c == '.') ++parts_;
    if (c == '\n' || c == '=' || c == ',') parts_ = 1;
    if (c == '[' || c == '{') open();
    if (c == ']' || c == '}') close();
  }

  void open() {
    ++depth_;
    parts_ = 1;
  }
  void close() {
    depth_ = std::max(0, depth_ - 1);
    parts_ = 1;
  }

  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool many_lines = text_.substr(at_).starts_with(three);
    const std::string end = many_lines ? three : std::string(1, quote);
    at_ += end.size();
    while (at_ < text_.size() && !text_.substr(at_).starts_with(end)) {
      if (!many_lines && text_[at_] == '\n') return;  // Not closed: the parser refuses it.
      at_ += quote == '"' && text_[at_] == '\\' ? 2 : 1;
    }
    at_ = std::min(at_ + end.size(), text_.size());
  }

  void skip_to(std::string_view end) { at_ = std::min(text_.find(end, at_), text_.size()); }

  std::string_view text_;
  std::size_t at_ = 0;
  int parts_ = 1;
  int depth_ = 0;
};

}  // namespace

std::optional<std::string> toml_nesting_problem(std::string_view text) {
  return Scanner(text).problem();
}

}  // namespace lensforge
