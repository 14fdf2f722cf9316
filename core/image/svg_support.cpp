// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_support.h"

#include <fcntl.h>
#include <librsvg/rsvg.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

// Determined by drawing with and without each feature in librsvg 2.54 and 2.60; SvgLeftOut's tests
// do the same. Values, rules and selectors that librsvg reports itself are read from its log.

constexpr const char* kToPaths = "turn it into outlines (in Inkscape: Path > Object to Path)";
constexpr const char* kFlowed = "turn it into plain text (in Inkscape: Text > Convert to Text)";
constexpr const char* kStill = "draw the moment that is meant";
constexpr const char* kNotSvg = "draw it with SVG's shapes and text";
constexpr const char* kPicture = "put it in as a picture (in Inkscape: Edit > Make a Bitmap Copy)";
constexpr const char* kMove = "move the text itself";
constexpr const char* kTransform = "write it as transform";
constexpr const char* kCover = "draw it as an element, such as rect";
constexpr const char* kTextPaths = "convert the text to paths";

constexpr std::array kElements{
    UndrawnThing{"textPath", "text on a path (textPath)", kToPaths},
    UndrawnThing{"flowRoot", "flowed text (flowRoot)", kFlowed},
    UndrawnThing{"textArea", "flowed text (textArea)", kFlowed},
    UndrawnThing{"foreignObject", "a part that is not SVG (foreignObject)", kNotSvg},
    UndrawnThing{"altGlyph", "glyphs of a font in the file (altGlyph)", kTextPaths},
    UndrawnThing{"font", "a font in the file (font)", kTextPaths},
    UndrawnThing{"meshgradient", "a mesh gradient (meshgradient)", kPicture},
    UndrawnThing{"meshGradient", "a mesh gradient (meshGradient)", kPicture},
    UndrawnThing{"mesh", "a mesh gradient (mesh)", kPicture},
    UndrawnThing{"hatch", "a hatch (hatch)", "fill with a pattern element"},
    UndrawnThing{"solidcolor", "a named colour (solidcolor)", "write the colour where it is used"},
    UndrawnThing{"solidColor", "a named colour (solidColor)", "write the colour where it is used"},
    UndrawnThing{"feDropShadow", "a shadow (feDropShadow)",
                 "use feGaussianBlur, feOffset and feMerge", "", 60},
    UndrawnThing{"animate", "animation (animate)", kStill},
    UndrawnThing{"animateColor", "animation (animateColor)", kStill},
    UndrawnThing{"animateMotion", "animation (animateMotion)", kStill},
    UndrawnThing{"animateTransform", "animation (animateTransform)", kStill},
    UndrawnThing{"set", "animation (set)", kStill},
    UndrawnThing{"script", "what a script does (script)", "save the drawing as it looks with it"},
    UndrawnThing{"video", "a film (video)", "put in one of its pictures"},
    UndrawnThing{"iframe", "another document (iframe)", kNotSvg},
    UndrawnThing{"canvas", "what a script draws (canvas)", kNotSvg},
};

/// The last entries show nothing by themselves.
constexpr std::array<std::string_view, 77> kDrawn{
    "a",
    "circle",
    "clipPath",
    "defs",
    "ellipse",
    "feBlend",
    "feColorMatrix",
    "feComponentTransfer",
    "feComposite",
    "feConvolveMatrix",
    "feDiffuseLighting",
    "feDisplacementMap",
    "feDistantLight",
    "feDropShadow",
    "feFlood",
    "feFuncA",
    "feFuncB",
    "feFuncG",
    "feFuncR",
    "feGaussianBlur",
    "feImage",
    "feMerge",
    "feMergeNode",
    "feMorphology",
    "feOffset",
    "fePointLight",
    "feSpecularLighting",
    "feSpotLight",
    "feTile",
    "feTurbulence",
    "filter",
    "g",
    "image",
    "line",
    "linearGradient",
    "marker",
    "mask",
    "path",
    "pattern",
    "polygon",
    "polyline",
    "radialGradient",
    "rect",
    "stop",
    "style",
    "svg",
    "switch",
    "symbol",
    "text",
    "tref",
    "tspan",
    "use",
    "altGlyphDef",
    "altGlyphItem",
    "audio",
    "color-profile",
    "cursor",
    "desc",
    "discard",
    "font-face",
    "font-face-format",
    "font-face-name",
    "font-face-src",
    "font-face-uri",
    "glyph",
    "glyphRef",
    "handler",
    "hkern",
    "listener",
    "metadata",
    "missing-glyph",
    "mpath",
    "prefetch",
    "tbreak",
    "title",
    "view",
    "vkern",
};

constexpr std::array kTextAttributes{
    UndrawnThing{"textLength", "the length that text is fitted to (textLength)", kToPaths},
    UndrawnThing{"rotate", "letters turned one by one (rotate)", kToPaths, "0 | 0deg"},
};

constexpr const char* kNormal = "normal";
constexpr const char* kBaselines =
    "auto | baseline | alphabetic | use-script | no-change | "
    "reset-size";

constexpr std::array kTextProperties{
    UndrawnThing{"word-spacing", "the space between words (word-spacing)", kMove,
                 "normal | 0 | 0px | 0em"},
    UndrawnThing{"text-transform", "a change of letters (text-transform)",
                 "write the letters that are meant", "none"},
    UndrawnThing{"dominant-baseline", "the height of text (dominant-baseline)", kMove, kBaselines,
                 60},
    UndrawnThing{"alignment-baseline", "the height of text (alignment-baseline)", kMove,
                 kBaselines},
    UndrawnThing{"font-variant", "a form of letters (font-variant)", kTextPaths, kNormal},
    UndrawnThing{"font-variant-caps", "a form of letters (font-variant-caps)", kTextPaths, kNormal},
    UndrawnThing{"font-variant-east-asian", "a form of letters (font-variant-east-asian)",
                 kTextPaths, kNormal},
    UndrawnThing{"font-variant-ligatures", "a form of letters (font-variant-ligatures)", kTextPaths,
                 kNormal},
    UndrawnThing{"font-variant-numeric", "a form of letters (font-variant-numeric)", kTextPaths,
                 kNormal},
    UndrawnThing{"font-variant-position", "a form of letters (font-variant-position)", kTextPaths,
                 kNormal},
    UndrawnThing{"font-feature-settings", "a form of letters (font-feature-settings)", kTextPaths,
                 kNormal},
    UndrawnThing{"font-variation-settings", "a form of letters (font-variation-settings)",
                 kTextPaths, kNormal},
    UndrawnThing{"font-kerning", "the space between letters (font-kerning)", kTextPaths,
                 "auto | normal"},
    UndrawnThing{"kerning", "the space between letters (kerning)", kTextPaths, "auto | 0"},
    UndrawnThing{"font-size-adjust", "a change of the letters' size (font-size-adjust)",
                 "give the size in font-size", "none"},
    UndrawnThing{"text-decoration-line", "a line along text (text-decoration-line)",
                 "use text-decoration", "none"},
    UndrawnThing{"text-shadow", "a shadow (text-shadow)", "draw the text twice", "none"},
    UndrawnThing{"-webkit-text-stroke", "a line around letters (-webkit-text-stroke)",
                 "use stroke"},
    UndrawnThing{"text-emphasis", "marks above text (text-emphasis)", kTextPaths, "none"},
    UndrawnThing{"text-indent", "an indent of text (text-indent)", kMove, "0 | 0px"},
    UndrawnThing{"inline-size", "the width of lines (inline-size)", kFlowed, "0 | auto"},
    UndrawnThing{"shape-inside", "text that fills a shape (shape-inside)", kFlowed, "none | auto"},
    UndrawnThing{"shape-subtract", "text around a shape (shape-subtract)", kFlowed, "none"},
    UndrawnThing{"white-space", "spaces and lines as typed (white-space)",
                 "use xml:space=\"preserve\" and a tspan for each line", "normal | nowrap"},
    UndrawnThing{"glyph-orientation-horizontal", "turned letters (glyph-orientation-horizontal)",
                 kToPaths, "auto | 0 | 0deg"},
};

constexpr std::array kProperties{
    UndrawnThing{"vector-effect", "lines that keep their width (vector-effect)",
                 "give stroke-width without transform", "none", 60},
    UndrawnThing{"color-interpolation", "mixing of colours in linear light (color-interpolation)",
                 "add stops to the gradient", "sRGB | auto"},
    UndrawnThing{"transform-origin", "the centre of a transform (transform-origin)",
                 "write it into transform, such as rotate(30, 50, 50)",
                 "0 | 0 0 | 0px 0px | 0% 0% | 0px | left top | top left"},
    UndrawnThing{"clip", "a clip (clip)", "use a clipPath element", "auto"},
};

constexpr std::array kStyleProperties{
    UndrawnThing{"transform-box", "the centre of a transform (transform-box)", kTransform,
                 "view-box"},
    UndrawnThing{"scale", "a change of size (scale)", kTransform, "none | 1"},
    UndrawnThing{"rotate", "a turn (rotate)", kTransform, "none | 0 | 0deg"},
    UndrawnThing{"translate", "a move (translate)", kTransform, "none | 0 | 0px"},
    UndrawnThing{"zoom", "a change of size (zoom)", kTransform, "1 | normal | 100%"},
    UndrawnThing{"offset-path", "a move along a path (offset-path)", kTransform, "none"},
    UndrawnThing{"offset", "a move along a path (offset)", kTransform, "none"},
    UndrawnThing{"perspective", "perspective (perspective)", kTransform, "none"},
    UndrawnThing{"mask-image", "a mask (mask-image)", "use a mask element", "none"},
    UndrawnThing{"mask-mode", "how a mask works (mask-mode)", "give the mask element mask-type",
                 "match-source"},
    UndrawnThing{"mask-composite", "how masks work together (mask-composite)",
                 "use one mask element", "add"},
    UndrawnThing{"-webkit-mask", "a mask (-webkit-mask)", "use a mask element", "none"},
    UndrawnThing{"-webkit-mask-image", "a mask (-webkit-mask-image)", "use a mask element", "none"},
    UndrawnThing{"backdrop-filter", "a change of what is behind (backdrop-filter)", kPicture,
                 "none"},
    UndrawnThing{"background", "a background (background)", kCover, "none | transparent | new"},
    UndrawnThing{"background-color", "a background (background-color)", kCover,
                 "none | transparent"},
    UndrawnThing{"background-image", "a background (background-image)", kCover, "none"},
    UndrawnThing{"d", "a path in a style (d)", "write it as the attribute d", "none"},
    UndrawnThing{"animation", "animation (animation)", kStill, "none"},
    UndrawnThing{"animation-name", "animation (animation-name)", kStill, "none"},
};

}  // namespace

std::span<const UndrawnThing> undrawn_elements() { return kElements; }
std::span<const std::string_view> drawn_elements() { return kDrawn; }
std::span<const UndrawnThing> undrawn_text_attributes() { return kTextAttributes; }
std::span<const UndrawnThing> undrawn_text_properties() { return kTextProperties; }
std::span<const UndrawnThing> undrawn_properties() { return kProperties; }
std::span<const UndrawnThing> undrawn_style_properties() { return kStyleProperties; }

const UndrawnThing* find_undrawn(std::span<const UndrawnThing> table, std::string_view name) {
  const auto found = std::find_if(table.begin(), table.end(), [&](const UndrawnThing& thing) {
    return thing.name == name && rsvg_minor_version < thing.drawn_since;
  });
  return found == table.end() ? nullptr : &*found;
}

bool is_harmless(const UndrawnThing& thing, std::string_view value) {
  for (const std::string_view keyword : {"", "inherit", "initial", "unset", "revert"}) {
    if (value == keyword) return true;
  }
  constexpr std::string_view kApart = " | ";
  std::string_view left = thing.harmless;
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(kApart), left.size());
    if (left.substr(0, end) == value) return true;
    left.remove_prefix(std::min(end + kApart.size(), left.size()));
  }
  return false;
}

namespace {

// With RSVG_LOG in its environment librsvg prints, on standard output,
//   Invalid declaration; ignoring: (ParseError { ... } }, "fill: var(--x);")
//   Invalid rule; ignoring: (ParseError { ... } }, "@media screen ")
//   (ignoring invalid presentation attribute fill
//       value="var(--x)"
//   ignoring attribute with invalid value: points: parse error: unexpected end of input
//   (not rendering element circle id=a because it is in error)
//   could not resolve paint server "#a", no alternate color specified
// Quotes in the first two are escaped. Before an invalid presentation attribute, librsvg 2.60
// prints the line on attributes, too; 2.54 prints the one on elements instead.

/// Maximum bytes of a file's name or value in a finding.
constexpr std::size_t kLongestValue = 60;

/// Maximum bytes examined per line.
constexpr std::size_t kLongestLine = std::size_t{64} << 10U;

/// Maximum kinds of findings: a file may cause a thousand.
constexpr std::size_t kMaxKinds = 24;

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

constexpr std::string_view kAroundRule = " \t\r\n;";

std::string in_quotes(std::string_view text) {
  std::string quoted = "'";
  quoted += printable_line(text, kLongestValue);
  return quoted += "'";
}

bool in_name(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '-'; }

/// The text between `before` and `after`; empty if there is none.
std::string_view between(std::string_view text, std::string_view before, std::string_view after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string_view::npos) return {};
  text.remove_prefix(begin + before.size());
  return text.substr(0, text.find(after));
}

/// The first pseudo-class or pseudo-element of a selector; empty if there is none.
std::string_view pseudo_in(std::string_view selector) {
  selector.remove_prefix(std::min(selector.find(':'), selector.size()));
  selector.remove_prefix(std::min(selector.find_first_not_of(':'), selector.size()));
  const auto end = std::find_if_not(selector.begin(), selector.end(), in_name);
  return selector.substr(0, static_cast<std::size_t>(end - selector.begin()));
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
  if (findings_.size() < kMaxKinds) findings_.emplace(kind, finding);
}

void SvgLogReader::take_value(std::string_view name, std::string_view value) {
  name = trimmed(name, kAroundRule);
  value = trimmed(value, kAroundRule);
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
  rule = trimmed(rule.substr(0, rule.find('{')), kAroundRule);
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
  const std::string_view pseudo = pseudo_in(rule);
  const bool never = std::find(kNeverSeen.begin(), kNeverSeen.end(), pseudo) != kNeverSeen.end();
  if (never && rule.find(',') == std::string_view::npos) return;
  add("rule " + std::string(pseudo),
      "left out the style rule of " + in_quotes(rule) + ": select by a class, such as .a");
}

void SvgLogReader::take_line(std::string_view line) {
  constexpr std::string_view kAttribute = "(ignoring invalid presentation attribute ";
  constexpr std::string_view kValue = "    value=\"";
  constexpr std::string_view kInvalid = "ignoring attribute with invalid value: ";
  constexpr std::string_view kElement = "(not rendering element ";
  if (line.starts_with("Invalid declaration; ")) {
    if (line.find("Custom(UnknownProperty)") == std::string_view::npos) {
      take_declaration(last_string(line));
    }
  } else if (line.starts_with("Invalid rule; ")) {
    take_rule(line, last_string(line));
  } else if (line.starts_with(kAttribute)) {
    attribute_ = line.substr(kAttribute.size());
    findings_.erase("attribute " + attribute_);  // Its value follows.
  } else if (line.starts_with(kValue)) {
    line.remove_prefix(kValue.size());
    take_value(attribute_, line.substr(0, line.rfind('"')));
  } else if (line.starts_with(kInvalid)) {
    const std::string_view name = between(line, kInvalid, ":");
    add("attribute " + std::string(name), "left out an attribute '" + printable_line(name) +
                                              "', whose value is not understood: give it a value "
                                              "that SVG 1.1 knows");
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
