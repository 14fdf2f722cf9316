// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_support.h"

#include <algorithm>
#include <array>

// Determined by drawing with and without each feature in librsvg 2.54.7; SvgLeftOut's tests do the
// same. Values, rules and selectors that librsvg reports itself are read by svg_log.h.
namespace lensforge {
namespace {

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
                 "feGaussianBlur, feOffset and feMerge would do"},
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
constexpr std::array<std::string_view, 76> kDrawn{
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
    UndrawnThing{"dominant-baseline", "the height of text (dominant-baseline)", kMove, kBaselines},
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
                 "text-decoration would do", "none"},
    UndrawnThing{"text-shadow", "a shadow (text-shadow)", "draw the text twice", "none"},
    UndrawnThing{"-webkit-text-stroke", "a line around letters (-webkit-text-stroke)",
                 "stroke would do"},
    UndrawnThing{"text-emphasis", "marks above text (text-emphasis)", kTextPaths, "none"},
    UndrawnThing{"text-indent", "an indent of text (text-indent)", kMove, "0 | 0px"},
    UndrawnThing{"inline-size", "the width of lines (inline-size)", kFlowed, "0 | auto"},
    UndrawnThing{"shape-inside", "text that fills a shape (shape-inside)", kFlowed, "none | auto"},
    UndrawnThing{"shape-subtract", "text around a shape (shape-subtract)", kFlowed, "none"},
    UndrawnThing{"white-space", "spaces and lines as typed (white-space)",
                 "xml:space=\"preserve\" and a tspan for each line would do", "normal | nowrap"},
    UndrawnThing{"glyph-orientation-horizontal", "turned letters (glyph-orientation-horizontal)",
                 kToPaths, "auto | 0 | 0deg"},
};

constexpr std::array kProperties{
    UndrawnThing{"vector-effect", "lines that keep their width (vector-effect)",
                 "give stroke-width without transform", "none"},
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
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&](const UndrawnThing& thing) { return thing.name == name; });
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

}  // namespace lensforge
