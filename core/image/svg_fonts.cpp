// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_fonts.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string_view>

#include "core/text/lower_case.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

/// Maximum bytes of a file's name in a message.
constexpr std::size_t kLongestName = 60;

/// CSS Fonts 4, section 2.1.3, the names that the drawing programs add, and keywords that name no
/// family.
constexpr std::array<std::string_view, 14> kGenericFamilies{
    "serif", "sans-serif", "sans",     "monospace", "mono",    "cursive",      "fantasy",
    "math",  "system-ui",  "ui-serif", "inherit",   "initial", "ui-monospace", "ui-sans-serif"};

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Pattern = std::unique_ptr<FcPattern, Free<FcPatternDestroy>>;
using Fonts = std::unique_ptr<FcFontSet, Free<FcFontSetDestroy>>;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kAround = " \t\r\n\"'";
  const std::size_t begin = text.find_first_not_of(kAround);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kAround) - begin + 1);
}

std::vector<std::string> families_in(std::string_view list) {
  std::vector<std::string> families;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::string_view family = trimmed(list.substr(0, comma));
    if (!family.empty()) families.emplace_back(family);
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return families;
}

bool is_generic(const std::string& family) {
  const auto& all = kGenericFamilies;
  return std::find(all.begin(), all.end(), lower_case(family)) != all.end();
}

Pattern pattern_for(const std::string& family) {
  Pattern pattern(FcPatternCreate());
  FcPatternAddString(pattern.get(), FC_FAMILY, reinterpret_cast<const FcChar8*>(family.c_str()));
  FcConfigSubstitute(nullptr, pattern.get(), FcMatchPattern);
  FcDefaultSubstitute(pattern.get());
  return pattern;
}

/// The family used to draw text in `family`: that one if it is installed under any of its names.
std::optional<std::string> drawn_family(const std::string& family) {
  FcResult result = FcResultNoMatch;
  const Pattern match(FcFontMatch(nullptr, pattern_for(family).get(), &result));
  FcChar8* name = nullptr;
  std::optional<std::string> first;
  for (int i = 0; match && FcPatternGetString(match.get(), FC_FAMILY, i, &name) == FcResultMatch;
       ++i) {
    const std::string one = reinterpret_cast<const char*>(name);
    if (lower_case(one) == lower_case(family)) return family;
    if (!first) first = one;
  }
  return first;
}

/// The characters of all installed fonts.
FcCharSet* installed_characters() {
  FcResult result = FcResultNoMatch;
  FcCharSet* characters = nullptr;
  const Fonts fonts(
      FcFontSort(nullptr, pattern_for("sans-serif").get(), FcTrue, &characters, &result));
  return characters;
}

std::string code_point(FcChar32 character) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "U+%04X", character);
  return text.data();
}

/// Names the font that replaces all of these; empty if one of them is used.
std::string remark_on(const std::vector<std::string>& families) {
  std::optional<std::string> drawn;
  for (const std::string& family : families) {
    const std::optional<std::string> found = drawn_family(family);
    if (is_generic(family) || found == family) return {};
    if (!drawn) drawn = found;
  }
  if (families.empty()) return {};
  return "text is drawn in the font '" + printable_line(drawn.value_or("none"), kLongestName) +
         "' because '" + printable_line(families.front(), kLongestName) +
         "' is not installed: install it, or convert the text to paths";
}

}  // namespace

std::string SvgFonts::problem_of(const std::string& text) {
  if (!installed_) installed_.reset(installed_characters());
  const auto* at = reinterpret_cast<const FcChar8*>(text.c_str());
  int left = static_cast<int>(text.size());
  FcChar32 character = 0;
  for (int used = 0; left > 0; at += used, left -= used) {
    used = FcUtf8ToUcs4(at, &character, left);
    if (used <= 0) return {};
    if (character <= ' ' || FcCharSetHasChar(installed_.get(), character) != FcFalse) continue;
    return "its text has the character " +
           printable_line({reinterpret_cast<const char*>(at), std::size_t(used)}) + " (" +
           code_point(character) +
           "), which no installed font has: install one, or convert the text to paths";
  }
  return {};
}

std::vector<std::string> SvgFonts::remarks() const {
  std::vector<std::string> all;
  for (const std::string& list : families_) {
    const std::string remark = remark_on(families_in(list));
    if (!remark.empty()) all.push_back(remark);
  }
  return all;
}

}  // namespace lensforge
