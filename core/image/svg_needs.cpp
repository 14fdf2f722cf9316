// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_needs.h"

#include <libxml/parser.h>
#include <libxml/xmlreader.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "core/image/svg_fonts.h"
#include "core/image/svg_pictures.h"
#include "core/image/svg_support.h"
#include "core/text/lower_case.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

/// Maximum bytes of a file's name in a message.
constexpr std::size_t kLongestName = 60;

/// Maximum names from the file in findings: it may have a thousand.
constexpr std::size_t kMostNames = 30;

/// Maximum nesting of drawings that is examined.
constexpr int kMostNested = 4;

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Reader = std::unique_ptr<xmlTextReader, Free<xmlFreeTextReader>>;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kAround = " \t\r\n\"'";
  const std::size_t begin = text.find_first_not_of(kAround);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kAround) - begin + 1);
}

/// A property and its value in CSS.
struct Declaration {
  std::string name;
  std::string value;
};

std::string without_comments(std::string_view css) {
  std::string rest;
  while (true) {
    const std::size_t begin = css.find("/*");
    rest += css.substr(0, begin);
    const std::size_t end = begin == std::string_view::npos ? begin : css.find("*/", begin + 2);
    if (end == std::string_view::npos) return rest;
    css.remove_prefix(end + 2);
  }
}

/// End of the piece of CSS that begins at `at`: the next brace or semicolon outside strings and
/// brackets.
std::size_t end_of_piece(std::string_view css, std::size_t at) {
  char quote = '\0';
  int depth = 0;
  for (; at < css.size(); ++at) {
    const char c = css[at];
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '(' || c == ')') {
      depth += c == '(' ? 1 : -1;
    } else if (c == '{' || c == '}' || (c == ';' && depth <= 0)) {
      break;
    }
  }
  return at;
}

/// All declarations, of style sheets and of style attributes.
std::vector<Declaration> declarations_in(const std::string& text) {
  const std::string css = without_comments(text);
  std::vector<Declaration> all;
  for (std::size_t at = 0; at < css.size();) {
    const std::size_t end = end_of_piece(css, at);
    const std::string_view piece = std::string_view(css).substr(at, end - at);
    at = end + 1;
    const std::size_t colon = piece.find(':');
    // Text before a brace is a selector.
    if (colon == std::string_view::npos || (end < css.size() && css[end] == '{')) continue;
    const std::string_view value = piece.substr(colon + 1);
    all.push_back({lower_case(std::string(trimmed(piece.substr(0, colon)))),
                   std::string(trimmed(value.substr(0, value.find('!'))))});
  }
  return all;
}

/// The numbers of a list, as text.
std::vector<std::string> entries_of(std::string_view list) {
  constexpr std::string_view kApart = " \t\r\n,";
  std::vector<std::string> entries;
  while (true) {
    list.remove_prefix(std::min(list.find_first_not_of(kApart), list.size()));
    if (list.empty()) return entries;
    const std::size_t end = std::min(list.find_first_of(kApart), list.size());
    entries.emplace_back(list.substr(0, end));
    list.remove_prefix(end);
  }
}

/// The families in a value of the property font: they follow the size, "bold 12px/1.5 Serif".
std::string families_of_font(std::string_view font) {
  for (const std::string& entry : entries_of(font)) {
    const std::string_view size = std::string_view(entry).substr(0, entry.find('/'));
    const char last = size.empty() ? '0' : size.back();
    const bool has_unit = last == '%' || std::isalpha(static_cast<unsigned char>(last)) != 0;
    if (!has_unit || size.find_first_of("0123456789") == std::string_view::npos) continue;
    return std::string(font.substr(font.find(entry) + entry.size()));
  }
  return {};
}

/// True if librsvg skips a child of a switch element: it supports the features of SVG 1.1 except
/// embedded documents.
bool asks_too_much(const std::string& extensions, const std::string& features) {
  for (const std::string& feature : entries_of(features)) {
    if (!feature.starts_with("http://www.w3.org/TR/SVG11/feature#")) return true;
    if (feature.ends_with("#Extensibility")) return true;
  }
  return !entries_of(extensions).empty();
}

/// Opens nothing.
xmlParserInput* refuse_entity(const char*, const char*, xmlParserCtxt*) { return nullptr; }

/// Walks through a file once.
class Survey {
 public:
  explicit Survey(int depth) : depth_(depth) {}

  SvgNeeds of(std::string_view xml) {
    xmlSetExternalEntityLoader(refuse_entity);
    const Reader reader(xmlReaderForMemory(xml.data(), static_cast<int>(xml.size()), nullptr,
                                           nullptr,
                                           XML_PARSE_NOENT | XML_PARSE_NONET | XML_PARSE_NOERROR |
                                               XML_PARSE_NOWARNING | XML_PARSE_RECOVER));
    reader_ = reader.get();
    while (reader_ != nullptr && xmlTextReaderRead(reader_) == 1) look_at_node();
    if (has_text_) {
      for (const std::string& remark : fonts_.remarks()) add(needs_.remarks, remark);
      for (const std::string& finding : of_text_) add(needs_.left_out, finding);
    }
    if (has_path_length_ && has_dashes_) {
      leave_out("dashes by the path's own length (pathLength)", "give them in its units");
    }
    return needs_;
  }

 private:
  /// State inherited by an element's children.
  struct Element {
    bool is_text = false;
    bool is_style = false;
    bool is_switch = false;
    bool is_chosen = false;  ///< For a switch: true if a child is certainly drawn.
    bool is_undrawn = false;
    std::string families;
  };

  void look_at_node() {
    const int type = xmlTextReaderNodeType(reader_);
    const auto depth = static_cast<std::size_t>(std::max(0, xmlTextReaderDepth(reader_)));
    path_.resize(depth);
    if (type == XML_READER_TYPE_ELEMENT) return enter();
    const std::string value = text_of(xmlTextReaderConstValue(reader_));
    if (type == XML_READER_TYPE_PROCESSING_INSTRUCTION) return look_at_instruction(value);
    const bool is_text = type == XML_READER_TYPE_TEXT || type == XML_READER_TYPE_CDATA;
    if (!is_text || path_.empty() || path_.back().is_undrawn) return;
    if (path_.back().is_style) look_at_sheet(value);
    if (path_.back().is_text) look_at_text(value);
  }

  void look_at_instruction(const std::string& value) {
    const std::string name = text_of(xmlTextReaderConstName(reader_));
    if (name != "xml-stylesheet" || value.find("\"#") != std::string::npos ||
        value.find("'#") != std::string::npos) {
      return;
    }
    leave_out("a style sheet that is not in the file (xml-stylesheet)", "put it into the file");
  }

  void enter() {
    Element element = path_.empty() ? Element{} : path_.back();
    const bool in_switch = std::exchange(element.is_switch, false);
    element.is_undrawn = element.is_undrawn || (in_switch && element.is_chosen);
    element.is_chosen = false;
    if (!element.is_undrawn) look_at_element(element, in_switch);
    path_.push_back(element);
  }

  void look_at_element(Element& element, bool in_switch) {
    const std::string name = text_of(xmlTextReaderConstLocalName(reader_));
    const std::string space = text_of(xmlTextReaderConstNamespaceUri(reader_));
    if (space == "http://www.w3.org/2001/XInclude") return look_at_links();
    look_at_conditions(element, in_switch);
    element.is_undrawn = element.is_undrawn || !is_drawn(name, space);
    if (element.is_undrawn) return;
    element.is_style = name == "style";
    if (element.is_style) look_at_medium(trimmed(attribute("media").value_or("")));
    element.is_switch = name == "switch";
    element.is_text = element.is_text || name == "text";
    look_at_attributes(element);
    if (name != "a" && name != "color-profile") look_at_links();
    if (name == "image" || name == "feImage") look_at_picture();
    if (name == "image" && has_length("width") != has_length("height")) {
      leave_out("the other side of a picture that has a width or a height alone", "give both");
    }
  }

  /// Reports the element if it is not drawn.
  bool is_drawn(const std::string& name, const std::string& space) {
    const bool svg = space.empty() || space == "http://www.w3.org/2000/svg";
    if (!svg && space != "http://www.w3.org/1999/xhtml") return false;
    for (const std::string_view silent : {"title", "desc", "metadata"}) {
      if (name == silent) return false;
    }
    const auto drawn = drawn_elements();
    if (svg && std::find(drawn.begin(), drawn.end(), name) != drawn.end()) return true;
    if (const UndrawnThing* thing = find_undrawn(undrawn_elements(), name)) {
      leave_out(*thing);
    } else if (is_new(name)) {
      leave_out("an element that SVG does not have ('" + printable_line(name, kLongestName) + "')",
                "draw it with SVG's shapes and text");
    }
    return false;
  }

  void look_at_conditions(Element& element, bool in_switch) {
    const std::string extensions = attribute("requiredExtensions").value_or("");
    const bool by_language = attribute("systemLanguage").has_value();
    if (!in_switch && (by_language || !extensions.empty())) {
      leave_out("a condition outside of a switch element (systemLanguage, requiredExtensions)",
                "take out what is not meant to be seen");
    }
    if (!in_switch) return;
    if (by_language) {
      add(needs_.remarks,
          "of parts in several languages (systemLanguage) those for this machine are drawn");
    }
    if (asks_too_much(extensions, attribute("requiredFeatures").value_or(""))) {
      element.is_undrawn = true;
    } else if (!by_language) {
      path_.back().is_chosen = true;
    }
  }

  void look_at_medium(std::string_view medium) {
    if (medium.empty() || medium == "all" || medium == "screen") return;
    leave_out("the medium that a style sheet is for (media)", "take out what is not for a screen");
  }

  void look_at_attributes(Element& element) {
    const bool is_text = element.is_text;
    while (xmlTextReaderMoveToNextAttribute(reader_) == 1) {
      const std::string name = text_of(xmlTextReaderConstName(reader_));
      const std::string value = text_of(xmlTextReaderConstValue(reader_));
      if (name == "font-family") {
        element.families = value;
      } else if (is_text && (name == "x" || name == "y" || name == "dx" || name == "dy")) {
        look_at_places(value);
      } else if (const UndrawnThing* thing = find_undrawn(undrawn_text_attributes(), name);
                 is_text && thing != nullptr) {
        look_at_letters(*thing, value);
      } else {
        look_at_property({name, std::string(trimmed(value))});
      }
    }
    xmlTextReaderMoveToElement(reader_);
    // A style has priority over attributes.
    for (const Declaration& one : declarations_in(attribute("style").value_or(""))) {
      look_at_style(one, element.families);
    }
  }

  void look_at_places(const std::string& list) {
    if (entries_of(list).size() < 2) return;
    leave_out("places of single letters (lists in x, y, dx, dy)",
              "turn the text into outlines (in Inkscape: Path > Object to Path)");
  }

  void look_at_letters(const UndrawnThing& thing, const std::string& list) {
    for (const std::string& entry : entries_of(list)) {
      if (!is_harmless(thing, entry)) leave_out(thing);
    }
  }

  /// A property given as an attribute.
  void look_at_property(const Declaration& property) {
    if (property.name == "pathLength") has_path_length_ = true;
    if (property.name == "stroke-dasharray" && property.value != "none") has_dashes_ = true;
    if (const UndrawnThing* thing = find_undrawn(undrawn_properties(), property.name)) {
      if (!is_harmless(*thing, property.value)) leave_out(*thing);
    } else if (const UndrawnThing* text = find_undrawn(undrawn_text_properties(), property.name)) {
      if (!is_harmless(*text, property.value)) add(of_text_, sentence(text->what, text->advice));
    }
    look_at_addresses(property.value);
  }

  /// A property in CSS. @param families  gets the text's families.
  void look_at_style(const Declaration& property, std::string& families) {
    if (property.name == "font-family") families = property.value;
    if (property.name == "font") families = families_of_font(property.value);
    if (property.name == "src") return;
    if (const UndrawnThing* thing = find_undrawn(undrawn_style_properties(), property.name)) {
      if (!is_harmless(*thing, property.value)) leave_out(*thing);
    }
    look_at_property(property);
  }

  /// Addresses in url() that refer outside the file.
  void look_at_addresses(std::string_view value) {
    constexpr std::string_view kBefore = "url(";
    for (std::size_t at = value.find(kBefore); at != std::string_view::npos;
         at = value.find(kBefore, at + 1)) {
      const std::string_view address = value.substr(at + kBefore.size());
      look_at_link(std::string(trimmed(address.substr(0, address.find(')')))));
    }
  }

  void look_at_links() {
    for (const char* name : {"href", "xlink:href"}) {
      if (const auto link = attribute(name)) look_at_link(*link);
    }
  }

  void look_at_link(const std::string& link) {
    if (link.empty() || link.starts_with('#') || lower_case(link.substr(0, 5)) == "data:") return;
    if (!is_new(link)) return;
    leave_out("'" + printable_line(link, kLongestName) + "', which is not in the file", "embed it");
  }

  void look_at_picture() {
    for (const char* name : {"href", "xlink:href"}) {
      const auto link = attribute(name);
      if (!link || lower_case(link->substr(0, 5)) != "data:") continue;
      const std::string finding = undrawn_of_picture(*link);
      if (!finding.empty() && is_new(finding)) add(needs_.left_out, finding);
      const std::string inner = depth_ < kMostNested ? drawing_at(*link) : "";
      if (!inner.empty()) take_over(Survey(depth_ + 1).of(inner));
    }
  }

  /// True if given as an attribute or in a style.
  [[nodiscard]] bool has_length(const char* name) const {
    if (attribute(name)) return true;
    const auto style = declarations_in(attribute("style").value_or(""));
    return std::any_of(style.begin(), style.end(),
                       [&](const Declaration& one) { return one.name == name; });
  }

  void take_over(const SvgNeeds& inner) {
    for (const std::string& remark : inner.remarks) add(needs_.remarks, remark);
    for (const std::string& finding : inner.left_out) add(needs_.left_out, finding);
    if (needs_.problem.empty()) needs_.problem = inner.problem;
  }

  void look_at_sheet(const std::string& css) {
    if (css.find("@import") != std::string::npos) {
      leave_out("a style sheet that is not in the file (@import)", "put it into the file");
    }
    for (const Declaration& one : declarations_in(css)) {
      std::string families;
      look_at_style(one, families);
      fonts_.add(families);
    }
  }

  void look_at_text(const std::string& text) {
    if (trimmed(text).empty()) return;
    has_text_ = true;
    fonts_.add(path_.back().families);
    if (needs_.problem.empty()) needs_.problem = fonts_.problem_of(text);
  }

  /// True for the first occurrence of a name, until there are kMostNames.
  bool is_new(const std::string& name) {
    return names_.size() < kMostNames && names_.insert(name).second;
  }

  void leave_out(const UndrawnThing& thing) {
    add(needs_.left_out, sentence(thing.what, thing.advice));
  }
  void leave_out(std::string_view what, std::string_view advice) {
    add(needs_.left_out, sentence(what, advice));
  }
  static std::string sentence(std::string_view what, std::string_view advice) {
    return "left out " + std::string(what) + ": " + std::string(advice);
  }

  static void add(std::vector<std::string>& all, const std::string& text) {
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

  int depth_;  ///< Nesting depth of drawings.
  xmlTextReader* reader_ = nullptr;
  std::vector<Element> path_;  ///< From the outermost element to the current one.
  SvgFonts fonts_;
  std::set<std::string> names_;
  bool has_text_ = false;
  bool has_path_length_ = false;
  bool has_dashes_ = false;
  std::vector<std::string> of_text_;  ///< Reported only if there is text.
  SvgNeeds needs_;
};

}  // namespace

SvgNeeds svg_needs(std::string_view xml) { return Survey(0).of(xml); }

}  // namespace lensforge
