// SPDX-License-Identifier: GPL-3.0-or-later
#include <fontconfig/fontconfig.h>
#include <gdk-pixbuf/gdk-pixbuf.h>
#include <libxml/parser.h>
#include <libxml/xmlreader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image/svg_support.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

/// Maximum bytes of a file's name in a message.
constexpr std::size_t kLongestQuote = 60;

/// White space and quotes.
constexpr std::string_view kAround = " \t\r\n\"'";

constexpr std::string_view kData = "data:";
constexpr std::string_view kBase64 = ";base64";

/// Maximum bytes of a file's type in a message.
constexpr std::size_t kLongestType = 40;

using Loader = std::unique_ptr<GdkPixbufLoader, Free<g_object_unref>>;
using Pixbuf = std::unique_ptr<GdkPixbuf, Free<g_object_unref>>;

/// A data: address (RFC 2397) in its parts.
struct Address {
  std::string type;  ///< "image/png", in small letters; empty without one.
  std::string bytes;
};

/// Decodes base64, ignoring white space and its entities.
std::string decoded(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '&') {
      i = std::min(text.find(';', i), text.size());
    } else if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      plain += c;
    }
  }
  gsize size = plain.size();
  if (size < 2) return {};
  g_base64_decode_inplace(plain.data(), &size);
  plain.resize(size);
  return plain;
}

/// Decodes percent signs.
std::string unescaped(std::string_view text) {
  GBytes* const bytes =
      g_uri_unescape_bytes(text.data(), static_cast<gssize>(text.size()), nullptr, nullptr);
  if (bytes == nullptr) return {};
  gsize size = 0;
  const auto* const data = static_cast<const char*>(g_bytes_get_data(bytes, &size));
  std::string plain = size > 0 ? std::string(data, size) : std::string();
  g_bytes_unref(bytes);
  return plain;
}

/// The address's parts; no bytes if it is not a data: address.
Address parts_of(std::string_view address) {
  const std::size_t comma = address.find(',');
  if (comma == std::string_view::npos) return {};
  const std::string head = lower_case(std::string(address.substr(0, comma)));
  if (!head.starts_with(kData)) return {};
  address.remove_prefix(comma + 1);
  return {head.substr(kData.size(), head.find(';') - kData.size()),
          head.ends_with(kBase64) ? decoded(address) : unescaped(address)};
}

bool is_drawing(const Address& address) { return address.type.find("svg") != std::string::npos; }

/// Decodes a picture of this type like librsvg; nothing if that fails.
Pixbuf loaded(const std::string& bytes, const std::string& type) {
  const Loader loader(type.empty() ? gdk_pixbuf_loader_new()
                                   : gdk_pixbuf_loader_new_with_mime_type(type.c_str(), nullptr));
  if (!loader) return nullptr;
  const bool written =
      gdk_pixbuf_loader_write(loader.get(), reinterpret_cast<const guchar*>(bytes.data()),
                              bytes.size(), nullptr) != FALSE;
  const bool closed = gdk_pixbuf_loader_close(loader.get(), nullptr) != FALSE;
  GdkPixbuf* const pixbuf = gdk_pixbuf_loader_get_pixbuf(loader.get());
  if (!written || !closed || pixbuf == nullptr) return nullptr;
  return Pixbuf(GDK_PIXBUF(g_object_ref(pixbuf)));
}

/// Exif number of the rotation needed; 1 for none.
int orientation_of(GdkPixbuf* pixbuf) {
  const char* const text = gdk_pixbuf_get_option(pixbuf, "orientation");
  return text != nullptr ? static_cast<int>(g_ascii_strtoll(text, nullptr, 10)) : 1;
}

/// A turned picture as an address; empty if it cannot be written.
std::string upright_address(GdkPixbuf* pixbuf) {
  const Pixbuf upright(gdk_pixbuf_apply_embedded_orientation(pixbuf));
  gchar* png = nullptr;
  gsize size = 0;
  if (gdk_pixbuf_save_to_buffer(upright.get(), &png, &size, "png", nullptr, nullptr) == FALSE) {
    return {};
  }
  gchar* const text = g_base64_encode(reinterpret_cast<const guchar*>(png), size);
  std::string address = std::string("data:image/png;base64,") + text;
  g_free(text);
  g_free(png);
  return address;
}

/// A replacement for this address; empty if none is needed.
std::string fit_address(std::string_view address, std::vector<std::string>& remarks) {
  const Address parts = parts_of(address);
  if (parts.bytes.empty() || is_drawing(parts)) return {};
  Pixbuf pixbuf = loaded(parts.bytes, parts.type);
  const bool wrong_type = !pixbuf;
  if (!pixbuf) pixbuf = loaded(parts.bytes, "");
  if (!pixbuf) return {};
  const int orientation = orientation_of(pixbuf.get());
  if (orientation > 1) {
    const std::string remark =
        "turned a picture in it upright (EXIF orientation " + std::to_string(orientation) + ")";
    if (std::find(remarks.begin(), remarks.end(), remark) == remarks.end()) {
      remarks.push_back(remark);
    }
    return upright_address(pixbuf.get());
  }
  if (!wrong_type) return {};
  const std::size_t comma = address.find(',');
  const std::size_t rest = lower_case(std::string(address.substr(0, comma))).ends_with(kBase64)
                               ? comma - kBase64.size()
                               : comma;
  return std::string(kData).append(address.substr(rest));
}

/// In plain words, what is left out of a picture at a data: address; empty if it is drawn whole and
/// upright.
std::string undrawn_of_picture(std::string_view address) {
  const Address parts = parts_of(address);
  if (is_drawing(parts)) return {};
  const Pixbuf pixbuf = loaded(parts.bytes, parts.type);
  if (!pixbuf) {
    return "left out a picture of type '" + printable_line(parts.type, kLongestType) +
           "', which cannot be read: embed it as PNG or JPEG";
  }
  const int orientation = orientation_of(pixbuf.get());
  if (orientation <= 1) return {};
  return "left out the turn of a picture (EXIF orientation " + std::to_string(orientation) +
         "): embed it as PNG";
}

/// The text of a drawing at a data: address; empty if there is none.
std::string drawing_at(std::string_view address) {
  const Address parts = parts_of(address);
  return is_drawing(parts) ? parts.bytes : "";
}

/// Checks the installed fonts (fontconfig) for a drawing's text. A font counts as installed if one
/// of the families that the text names is installed or generic.
class SvgFonts {
 public:
  /// @param families  as font-family lists them.
  void add(const std::string& families) {
    if (families_.size() < kMaxLists) families_.insert(families);
  }

  /// The first character that no installed font has, as a problem; empty if there is none.
  [[nodiscard]] std::string problem_of(const std::string& text);

  /// In plain words, the fonts that replace others.
  [[nodiscard]] std::vector<std::string> remarks() const;

 private:
  /// A look-up takes a millisecond, and a file may have a million lists.
  static constexpr std::size_t kMaxLists = 100;

  struct DestroyCharacters {
    void operator()(FcCharSet* characters) const { FcCharSetDestroy(characters); }
  };

  std::set<std::string> families_;
  std::unique_ptr<FcCharSet, DestroyCharacters> installed_;  ///< The characters of all fonts.
};

/// CSS Fonts 4, section 2.1.3, the names that the drawing programs add, and keywords that name no
/// family.
constexpr std::array<std::string_view, 14> kGenericFamilies{
    "serif", "sans-serif", "sans",     "monospace", "mono",    "cursive",      "fantasy",
    "math",  "system-ui",  "ui-serif", "inherit",   "initial", "ui-monospace", "ui-sans-serif"};

using Pattern = std::unique_ptr<FcPattern, Free<FcPatternDestroy>>;
using Fonts = std::unique_ptr<FcFontSet, Free<FcFontSetDestroy>>;

std::vector<std::string> families_in(std::string_view list) {
  std::vector<std::string> families;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::string_view family = trimmed(list.substr(0, comma), kAround);
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
  return "text is drawn in the font '" + printable_line(drawn.value_or("none"), kLongestQuote) +
         "' because '" + printable_line(families.front(), kLongestQuote) +
         "' is not installed: install it, or convert the text to paths";
}

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

/// Maximum names from the file in findings: it may have a thousand.
constexpr std::size_t kMaxNames = 30;

/// Maximum nesting of drawings that is examined.
constexpr int kMaxNested = 4;

using Reader = std::unique_ptr<xmlTextReader, Free<xmlFreeTextReader>>;

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
    all.push_back({lower_case(std::string(trimmed(piece.substr(0, colon), kAround))),
                   std::string(trimmed(value.substr(0, value.find('!')), kAround))});
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
    if (element.is_style) look_at_medium(trimmed(attribute("media").value_or(""), kAround));
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
    if (const UndrawnThing* thing = find_undrawn(undrawn_elements(), name)) {
      leave_out(*thing);
    } else if (svg && std::find(drawn.begin(), drawn.end(), name) != drawn.end()) {
      return true;
    } else if (is_new(name)) {
      leave_out("an element that SVG does not have ('" + printable_line(name, kLongestQuote) + "')",
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
        look_at_property({name, std::string(trimmed(value, kAround))});
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
      look_at_link(std::string(trimmed(address.substr(0, address.find(')')), kAround)));
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
    leave_out(
        std::string("'") + printable_line(link, kLongestQuote) + "', which is not in the file",
        "embed it");
  }

  void look_at_picture() {
    for (const char* name : {"href", "xlink:href"}) {
      const auto link = attribute(name);
      if (!link || lower_case(link->substr(0, 5)) != "data:") continue;
      const std::string finding = undrawn_of_picture(*link);
      if (!finding.empty() && is_new(finding)) add(needs_.left_out, finding);
      const std::string inner = depth_ < kMaxNested ? drawing_at(*link) : "";
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
    if (trimmed(text, kAround).empty()) return;
    has_text_ = true;
    fonts_.add(path_.back().families);
    if (needs_.problem.empty()) needs_.problem = fonts_.problem_of(text);
  }

  /// True for the first occurrence of a name, until there are kMaxNames.
  bool is_new(const std::string& name) {
    return names_.size() < kMaxNames && names_.insert(name).second;
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

std::string with_fit_pictures(const std::string& xml, std::vector<std::string>& remarks) {
  std::string fit;
  std::size_t kept = 0;
  for (std::size_t at = xml.find(kData); at != std::string::npos; at = xml.find(kData, at + 1)) {
    if (at == 0 || (xml[at - 1] != '"' && xml[at - 1] != '\'')) continue;
    const std::size_t end = xml.find(xml[at - 1], at);
    if (end == std::string::npos) break;
    const std::string address = fit_address(std::string_view(xml).substr(at, end - at), remarks);
    if (address.empty()) continue;
    fit.append(xml, kept, at - kept).append(address);
    kept = end;
  }
  return fit.append(xml, kept);
}

SvgNeeds svg_needs(std::string_view xml) { return Survey(0).of(xml); }

}  // namespace lensforge
