// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_needs.h"

#include <fontconfig/fontconfig.h>
#include <libxml/xmlreader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <optional>

#include "core/text/lower_case.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

/// Bytes of a name out of the file in a message.
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
using Characters = std::unique_ptr<FcCharSet, Free<FcCharSetDestroy>>;
using Fonts = std::unique_ptr<FcFontSet, Free<FcFontSetDestroy>>;
using Reader = std::unique_ptr<xmlTextReader, Free<xmlFreeTextReader>>;

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

/// The values of all declarations of font-family in CSS.
std::vector<std::string_view> font_families_in_css(std::string_view css) {
  constexpr std::string_view kName = "font-family";
  std::vector<std::string_view> values;
  for (std::size_t at = css.find(kName); at != std::string_view::npos; at = css.find(kName, at)) {
    at += kName.size();
    const std::size_t colon = css.find_first_not_of(" \t\r\n", at);
    if (colon == std::string_view::npos || css[colon] != ':') continue;
    values.push_back(css.substr(colon + 1, css.find_first_of(";}!", colon) - colon - 1));
  }
  return values;
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

/// The family that text in `family` is drawn in: that one if it is installed, under any of its
/// names.
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
Characters installed_characters() {
  FcResult result = FcResultNoMatch;
  FcCharSet* characters = nullptr;
  const Fonts fonts(
      FcFontSort(nullptr, pattern_for("sans-serif").get(), FcTrue, &characters, &result));
  return Characters(characters);
}

std::string code_point(FcChar32 character) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "U+%04X", character);
  return text.data();
}

/// Walks through a file once.
class Survey {
 public:
  SvgNeeds of(std::string_view xml) {
    const Reader reader(xmlReaderForMemory(
        xml.data(), static_cast<int>(xml.size()), nullptr, nullptr,
        XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING | XML_PARSE_RECOVER));
    reader_ = reader.get();
    while (reader_ != nullptr && xmlTextReaderRead(reader_) == 1) look_at_node();
    if (has_text_) judge_families();
    return needs_;
  }

 private:
  void look_at_node() {
    const int type = xmlTextReaderNodeType(reader_);
    const auto depth = static_cast<std::size_t>(std::max(0, xmlTextReaderDepth(reader_)));
    path_.resize(depth);
    if (type == XML_READER_TYPE_ELEMENT) return enter();
    const bool is_text = type == XML_READER_TYPE_TEXT || type == XML_READER_TYPE_CDATA;
    if (!is_text || path_.empty()) return;
    const std::string value = text_of(xmlTextReaderConstValue(reader_));
    if (path_.back().is_style) look_at_css(value);
    if (path_.back().is_text) look_at_text(value);
  }

  void enter() {
    Element element = path_.empty() ? Element{} : path_.back();
    const std::string name = text_of(xmlTextReaderConstLocalName(reader_));
    element.is_style = name == "style";
    element.is_text = element.is_text || name == "text";
    if (const auto list = attribute("font-family")) element.families = *list;
    if (const auto style = attribute("style")) {
      for (const std::string_view list : font_families_in_css(*style)) element.families = list;
    }
    if (name == "image" || name == "use" || name == "feImage") look_at_links();
    path_.push_back(element);
  }

  void look_at_links() {
    for (const char* name : {"href", "xlink:href"}) {
      const auto link = attribute(name);
      if (!link || link->empty() || link->starts_with('#') || link->starts_with("data:")) continue;
      remark("left out '" + printable_line(*link, kLongestName) +
             "', which is not in the file: embed it");
    }
  }

  void look_at_css(const std::string& css) {
    if (css.find("@import") != std::string::npos) {
      remark("left out a style sheet that is not in the file (@import)");
    }
    for (const std::string_view list : font_families_in_css(css)) families_.emplace_back(list);
  }

  void look_at_text(const std::string& text) {
    if (trimmed(text).empty()) return;
    has_text_ = true;
    families_.push_back(path_.back().families);
    if (!installed_) installed_ = installed_characters();
    const auto* at = reinterpret_cast<const FcChar8*>(text.c_str());
    int left = static_cast<int>(text.size());
    FcChar32 character = 0;
    for (int used = 0; left > 0 && needs_.problem.empty(); at += used, left -= used) {
      used = FcUtf8ToUcs4(at, &character, left);
      if (used <= 0) return;
      if (character <= ' ' || FcCharSetHasChar(installed_.get(), character) != FcFalse) continue;
      needs_.problem = "its text has the character " +
                       printable_line({reinterpret_cast<const char*>(at), std::size_t(used)}) +
                       " (" + code_point(character) +
                       "), which no installed font has: install one, or convert the text to paths";
    }
  }

  void judge_families() {
    std::sort(families_.begin(), families_.end());
    families_.erase(std::unique(families_.begin(), families_.end()), families_.end());
    for (const std::string& list : families_) judge(families_in(list));
  }

  void judge(const std::vector<std::string>& families) {
    std::optional<std::string> drawn;
    for (const std::string& family : families) {
      const std::optional<std::string> found = drawn_family(family);
      if (is_generic(family) || found == family) return;
      if (!drawn) drawn = found;
    }
    if (families.empty()) return;
    remark("text is drawn in the font '" + printable_line(drawn.value_or("none"), kLongestName) +
           "' because '" + printable_line(families.front(), kLongestName) +
           "' is not installed: install it, or convert the text to paths");
  }

  void remark(const std::string& text) {
    auto& all = needs_.remarks;
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  }

  static std::string text_of(const xmlChar* text) {
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
  }

  [[nodiscard]] std::optional<std::string> attribute(const char* name) const {
    const std::unique_ptr<xmlChar, void (*)(xmlChar*)> value(
        xmlTextReaderGetAttribute(reader_, reinterpret_cast<const xmlChar*>(name)),
        [](xmlChar* text) { xmlFree(text); });
    if (!value) return std::nullopt;
    return text_of(value.get());
  }

  /// What an element passes on to those in it.
  struct Element {
    bool is_text = false;
    bool is_style = false;
    std::string families;
  };

  xmlTextReader* reader_ = nullptr;
  std::vector<Element> path_;  ///< From the outermost element to the one at hand.
  std::vector<std::string> families_;
  bool has_text_ = false;
  Characters installed_;
  SvgNeeds needs_;
};

}  // namespace

SvgNeeds svg_needs(std::string_view xml) { return Survey().of(xml); }

}  // namespace lensforge
