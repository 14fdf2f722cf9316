// SPDX-License-Identifier: GPL-3.0-or-later
// What librsvg does not draw is named.
#include <OpenImageIO/strutil.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/image/picture_refusal.h"
#include "core/image/svg_drawing.h"
#include "core/image/svg_support.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge::svg_left_out_test {
namespace {

using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string svg(const std::string& content) {
  return "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' "
         "xmlns:h='http://www.w3.org/1999/xhtml' viewBox='0 0 100 100'>" +
         content + "</svg>";
}

/// In front of black, and not black all over.
std::string scene(const std::string& content) {
  return svg(
      "<rect width='100' height='100'/><rect x='90' y='90' width='9' height='9' "
      "fill='white'/>" +
      content);
}

SvgPicture drawn(const std::string& text, int side = 32) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", text);
  return draw_svg(folder / "a.svg", side);
}

/// What stands in a drawing, what librsvg makes of it, and how that is named.
struct Row {
  std::string content;
  std::string drawn_as;
  std::string named;
};

const std::string kPath = "<path id='p' fill='none' d='M10 50H90'/>";
const std::string kArea = "<rect width='50' height='50' fill='white'/>";
const std::string kText =
    "<text x='5' y='40' font-size='20' fill='white' font-family='DejaVu Sans'";

std::string text(const std::string& attributes) {
  return kText + " " + attributes + ">Ab c</text>";
}

std::string area(const std::string& attributes) {
  return "<rect width='50' height='50' fill='white' " + attributes + "/>";
}

std::vector<Row> element_rows() {
  return {
      {kPath + "<text fill='white'><textPath xlink:href='#p'>Round</textPath></text>", "",
       "text on a path"},
      {"<flowRoot fill='white'><flowRegion>" + kArea +
           "</flowRegion><flowPara>A</flowPara>"
           "</flowRoot>",
       "", "flowed text (flowRoot)"},
      {"<foreignObject width='90' height='50'><h:div>Hello</h:div></foreignObject>", "",
       "a part that is not SVG"},
      {"<switch><foreignObject width='90' height='50'/>" + kArea + "</switch>", "",
       "a part that is not SVG"},
      {"<meshgradient id='m'><meshrow/></meshgradient><rect width='9' height='9' fill='url(#m)'/>",
       "", "mesh gradient"},
      {"<hatch id='m' pitch='3'><hatchpath stroke='white'/></hatch>"
       "<rect width='9' height='9' fill='url(#m)'/>",
       "", "hatch"},
      {"<solidcolor id='m' solid-color='white'/><rect width='9' height='9' fill='url(#m)'/>", "",
       "named colour"},
      {"<filter id='f' x='-1' y='-1' width='3' height='3'><feDropShadow dx='30' dy='0' "
       "flood-color='white'/></filter><rect width='20' height='20' filter='url(#f)'/>",
       "", "(feDropShadow)"},
      {"<rect width='50' height='50'><animate attributeName='fill' to='white' dur='1s'/></rect>",
       "", "animation (animate)"},
      {"<rect width='50' height='50'><set attributeName='fill' to='white'/></rect>", "",
       "animation (set)"},
      {"<script>draw()</script>", "", "script"},
      {"<h:canvas width='9' height='9'/>", "", "canvas"},
      {"<blink>" + kArea + "</blink>", "", "an element that SVG does not have ('blink')"},
      {"<image width='9' height='9' xlink:href='data:image/webp;base64,UklGRg=='/>", "",
       "a picture of type 'image/webp'"},
      {"<use href='other.svg#a'/>", "", "'other.svg#a', which is not in the file"},
      {"<g fill='url(other.svg#a)'>" + std::string("<rect width='9' height='9'/></g>"), "",
       "'other.svg#a', which is not in the file"},
  };
}

/// One white pixel as PNG.
const std::string kPixel =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2"
    "FAAAAABJRU5ErkJggg==";

std::vector<Row> attribute_rows() {
  return {
      {text("textLength='90'"), text(""), "textLength"},
      {text("rotate='0 40'"), text(""), "letters turned one by one"},
      {kText + "><tspan x='5 30 60'>Ab c</tspan></text>", text(""), "places of single letters"},
      {text("dx='0 10'"), text(""), "places of single letters"},
      {text("word-spacing='10'"), text(""), "word-spacing"},
      {text("dominant-baseline='hanging'"), text(""), "(dominant-baseline)"},
      {text("style='text-transform:uppercase'"), text(""), "text-transform"},
      {text("style='text-shadow:9px 9px white'"), text(""), "text-shadow"},
      {text("style='font-feature-settings:\"smcp\"'"), text(""), "font-feature-settings"},
      {text("style='text-decoration-line:underline'"), text(""), "text-decoration-line"},
      {"<style>text{word-spacing:9px}</style>" + text(""), text(""), "word-spacing"},
      {"<path d='M0 10H9' stroke='white' stroke-dasharray='1' pathLength='3'/>",
       "<path d='M0 10H9' stroke='white' stroke-dasharray='1'/>", "pathLength"},
      {"<path d='M0 1H10' stroke='white' transform='scale(5)' vector-effect='non-scaling-stroke'/>",
       "<path d='M0 1H10' stroke='white' transform='scale(5)'/>", "(vector-effect)"},
      {area("transform='scale(.5)' transform-origin='50 50'"), area("transform='scale(.5)'"),
       "transform-origin"},
      {area("style='scale:.5'"), area(""), "a change of size (scale)"},
      {area("style='rotate:30deg'"), area(""), "a turn (rotate)"},
      {area("style='offset-path:path(\"M9 9L99 9\")'"), area(""), "offset-path"},
      {area("style='mask-image:linear-gradient(red,transparent)'"), area(""), "mask-image"},
      {area("style='zoom:.5'"), area(""), "zoom"},
      {"<path style='d:path(\"M0 0H50V50z\");fill:white'/>", "", "a path in a style (d)"},
      {"<g style='background:white'/>", "", "background"},
      {"<image width='50' href='" + kPixel + "'/>",
       "<image width='50' height='1' href='" + kPixel + "'/>", "the other side of a picture"},
      {"<g systemLanguage='xx'>" + kArea + "</g>", kArea, "a condition outside of a switch"},
  };
}

std::vector<Row> value_rows() {
  const std::string plain = "<rect class='a' width='50' height='50'/>";
  return {
      {"<rect width='50' height='50' style='--c:white;fill:var(--c)'/>", "", "fill: var(--c)"},
      {"<rect width='50' height='50' fill='oklch(1 0 0)'/>", "", "fill: oklch(1 0 0)"},
      {"<rect width='50' height='50' fill='white icc-color(x,1)'/>", "", "icc-color"},
      {"<rect height='50' fill='white' width='calc(1px + 2px)'/>", "", "calc(1px + 2px)"},
      {"<rect height='50' fill='white' style='width:min(9px,5px)'/>", "", "min(9px,5px)"},
      {"<rect height='50' fill='white' width='3rem'/>", "", "width: 3rem"},
      {area("style='clip-path:polygon(0 0,9px 0,9px 9px)'"), area(""), "use a clipPath element"},
      {"<style>@media screen{.a{fill:white}}</style>" + plain, plain, "'@media screen'"},
      {"<style>@supports (fill:red){.a{fill:white}}</style>" + plain, plain, "@supports"},
      {"<style>rect:is(.a){fill:white}</style>" + plain, plain, "'rect:is(.a)'"},
      {"<style>.a:hover,.a{fill:white}</style>" + plain, plain, "'.a:hover,.a'"},
      {"<style>svg{.a{fill:white}}</style>" + plain, plain, "nested rule '.a{fill:white}'"},
      {"<style>@font-face{font-family:x;src:url(y)}</style>", "", "@font-face"},
      {"<style>@keyframes a{from{fill:red}}</style>", "", "@keyframes"},
      {"<style media='print'>.a{fill:white}</style>" + plain, kArea, "(media)"},
      {"<style>@import 'a.css';</style>", "", "@import"},
      {"<rect width='50' height='50' fill='url(#nowhere)'/>", "", "left out the paint '#"},
      {"<use width='calc(1px)' href='#p'/>", "", "calc(1px)"},
      {"<polygon points='1,2 3' fill='white'/>", "", "not understood"},
  };
}

/// True if a row of the tables is about a feature that the librsvg here draws.
bool is_drawn_here(std::span<const UndrawnThing> table, const UndrawnThing& thing) {
  return find_undrawn(table, thing.name) == nullptr;
}

bool is_drawn_here(const Row& row) {
  for (const auto table : {undrawn_elements(), undrawn_text_properties(), undrawn_properties()}) {
    for (const UndrawnThing& thing : table) {
      if (is_drawn_here(table, thing) && thing.what.ends_with(row.named)) return true;
    }
  }
  return false;
}

class SvgLeftOut : public ::testing::TestWithParam<Row> {};

TEST_P(SvgLeftOut, IsNamedUnlessItIsDrawn) {
  const Row& row = GetParam();
  const SvgPicture picture = drawn(scene(row.content));
  const bool same = picture.light == drawn(scene(row.drawn_as)).light;
  EXPECT_EQ(same, !is_drawn_here(row)) << row.content;
  if (is_drawn_here(row)) {
    EXPECT_THAT(picture.left_out, Not(Contains(HasSubstr(row.named)))) << row.content;
  } else {
    EXPECT_THAT(picture.left_out, Contains(HasSubstr(row.named))) << row.content;
  }
}

INSTANTIATE_TEST_SUITE_P(Elements, SvgLeftOut, ::testing::ValuesIn(element_rows()));
INSTANTIATE_TEST_SUITE_P(Attributes, SvgLeftOut, ::testing::ValuesIn(attribute_rows()));
INSTANTIATE_TEST_SUITE_P(Values, SvgLeftOut, ::testing::ValuesIn(value_rows()));

/// Of one document with all of them.
std::vector<std::string> named_in(const std::string& content) {
  return drawn(scene(content), 8).left_out;
}

TEST(SvgLeftOut, EveryRowOfTheTablesIsNamed) {
  std::string content;
  std::vector<std::string_view> expected;
  for (const UndrawnThing& thing : undrawn_elements()) {
    if (is_drawn_here(undrawn_elements(), thing)) continue;
    content += "<" + std::string(thing.name) + "/>";
    expected.push_back(thing.what);
  }
  for (const UndrawnThing& thing : undrawn_text_attributes()) {
    content += text(std::string(thing.name) + "='7'");
    expected.push_back(thing.what);
  }
  for (const auto table :
       {undrawn_text_properties(), undrawn_properties(), undrawn_style_properties()}) {
    for (const UndrawnThing& thing : table) {
      if (is_drawn_here(table, thing)) continue;
      content += "<g style='" + std::string(thing.name) + ": 7px'/>";
      expected.push_back(thing.what);
    }
  }
  const std::vector<std::string> named = named_in(content);
  for (const std::string_view what : expected) {
    EXPECT_THAT(named, Contains(HasSubstr("left out " + std::string(what) + ": ")));
  }
}

TEST(SvgLeftOut, ValuesThatChangeNothingAreNotNamed) {
  std::string content = text("rotate='0 0' style='text-decoration-color:#000000'");
  for (const auto table :
       {undrawn_text_properties(), undrawn_properties(), undrawn_style_properties()}) {
    for (const UndrawnThing& thing : table) {
      if (thing.harmless.empty()) continue;
      const std::string first(thing.harmless.substr(0, thing.harmless.find(" | ")));
      content += "<g style='" + std::string(thing.name) + ":" + first + "'/>";
      content += "<g style='" + std::string(thing.name) + " : inherit ; '/>";
    }
  }
  EXPECT_THAT(named_in(content), IsEmpty());
}

TEST(SvgLeftOut, WhatOtherProgramsWriteForThemselvesIsNotNamed) {
  const std::string inkscape =
      "<sodipodi:namedview xmlns:sodipodi='s'><inkscape:grid xmlns:inkscape='i'/>"
      "</sodipodi:namedview><metadata><rdf:RDF xmlns:rdf='r'><blink/></rdf:RDF></metadata>"
      "<title>A</title><desc>B</desc>" +
      area(
          "style='-inkscape-stroke:none;font-variant-ligatures:normal;text-indent:0;"
          "text-transform:none;vector-effect:none;color-interpolation:sRGB;mix-blend-mode:normal;"
          "shape-padding:0;white-space:normal;word-spacing:normal;writing-mode:lr-tb;"
          "dominant-baseline:auto;text-decoration:none;text-decoration-line:none;"
          "solid-color:#000000;enable-background:accumulate;marker:none;line-height:125%'");
  const std::string others =
      "<g inkscape:label='a' xmlns:inkscape='i' data-name='b' aria-label='c' class='d'/>"
      "<style>.e{fill:white;enable-background:new    ;} .f:hover{fill:red}</style>"
      "<switch><foreignObject requiredExtensions='http://ns.adobe.com/x'/><g>" +
      kArea +
      "</g></switch><switch><foreignObject "
      "requiredFeatures='http://www.w3.org/TR/SVG11/feature#Extensibility'/>" +
      kArea + "<foreignObject/></switch><a href='http://example.org'>" + kArea + "</a>";
  EXPECT_THAT(named_in(inkscape + others), IsEmpty());
}

TEST(SvgLeftOut, PropertiesOfTextMatterWhereThereIsText) {
  const std::string spaced = "<g style='word-spacing:3px'/>";
  EXPECT_THAT(named_in(spaced), IsEmpty());
  EXPECT_THAT(named_in(spaced + text("")), Contains(HasSubstr("word-spacing")));
}

TEST(SvgLeftOut, IsNamedInDrawingsAndEntitiesInsideOfADrawing) {
  const std::string inner = svg(kArea + "<foreignObject/>");
  EXPECT_THAT(named_in("<image width='9' height='9' xlink:href='data:image/svg+xml;base64," +
                       OIIO::Strutil::base64_encode(inner) + "'/>"),
              Contains(HasSubstr("foreignObject")));
  const SvgPicture picture =
      drawn("<!DOCTYPE svg [<!ENTITY e '<foreignObject/>'>]>" + scene("&e;"));
  EXPECT_THAT(picture.left_out, Contains(HasSubstr("foreignObject")));
}

TEST(SvgLeftOut, AStyleSheetBesideTheFileIsNamed) {
  EXPECT_THAT(drawn("<?xml-stylesheet href='a.css'?>" + scene("")).left_out,
              ElementsAre(HasSubstr("xml-stylesheet")));
  EXPECT_THAT(drawn("<?xml-stylesheet href='#a'?>" + scene("<style id='a'/>")).left_out, IsEmpty());
}

TEST(SvgLeftOut, IsWhyADrawingIsBlack) {
  const TempFolder folder;
  write_bytes(folder / "a.svg",
              svg("<rect width='100' height='100'/><rect width='9' height='9' fill='var(--c)'/>"));
  EXPECT_THAT(lensforge::testing::picture_refusal(folder / "a.svg"),
              HasSubstr("is black all over; left out 'fill: var(--c)': write the value itself"));
  write_bytes(folder / "a.svg", svg("<foreignObject/>"));
  EXPECT_THAT(lensforge::testing::picture_refusal(folder / "a.svg"),
              HasSubstr("; left out a part that is not SVG (foreignObject)"));
}

TEST(SvgLeftOut, SoManyKindsAreKeptAsAReaderCanRead) {
  SvgLogReader reader;
  for (int i = 0; i < 1000; ++i) {
    reader.take_line(
        "Invalid declaration; ignoring: (ParseError { location: L { column: 1 } }, "
        "\"fill: f" +
        std::string(static_cast<std::size_t>(i), 'x') + "(1);\")");
  }
  EXPECT_LE(reader.findings().size(), 24U);
  EXPECT_THAT(reader.findings(), Contains("left out 'fill: f(1)': give it a value that SVG 1.1 "
                                          "knows"));
}

/// A random drawing of things that are drawn and things that are not.
class Composer {
 public:
  explicit Composer(unsigned seed) : random_(seed) {}

  /// @param most  things that are not drawn, at most.
  std::string compose(int depth, std::size_t most) {
    std::string content;
    const std::size_t count = 1 + below(4);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t kind = below(3);
      if (kind == 0 && depth > 0) {
        static const std::vector<std::string> kGroups{"g", "svg", "a", "g opacity='0.9'"};
        const std::string& group = kGroups[below(kGroups.size())];
        content += "<" + group + ">" + compose(depth - 1, most) + "</" +
                   group.substr(0, group.find(' ')) + ">";
      } else if (kind == 1 && expected_.size() < most) {
        static const std::vector<Row> kAll = all_rows();
        const Row& row = kAll[below(kAll.size())];
        content += row.content;
        expected_.insert(row.named);
      } else {
        content += drawn_thing();
      }
    }
    return content;
  }

  [[nodiscard]] const std::set<std::string>& expected() const { return expected_; }

 private:
  static std::vector<Row> all_rows() {
    std::vector<Row> all = element_rows();
    for (const auto& rows : {attribute_rows(), value_rows()}) {
      all.insert(all.end(), rows.begin(), rows.end());
    }
    std::erase_if(all, [](const Row& row) { return is_drawn_here(row); });
    return all;
  }

  std::string drawn_thing() {
    static const std::vector<std::string> kDrawn{
        kArea,
        text(""),
        "<circle cx='40' cy='40' r='9' fill='#fff' style='stroke:rgb(1,2,3);stroke-width:2px'/>",
        "<path d='M0 0L9 9z' transform='rotate(30)' stroke='red' stroke-dasharray='1 2'/>",
        "<style>.z{fill:hsl(0,0%,50%)}</style><polygon class='z' points='0,0 9,0 9,9'/>",
        std::string("<defs><linearGradient id='lg'><stop stop-color='white'/></linearGradient>") +
            "</defs><ellipse rx='9' ry='4' fill='url(#lg)'/>",
        std::string("<clipPath id='cp'><circle r='20'/></clipPath>") +
            "<rect width='50' height='9' clip-path='url(#cp)'/>",
        std::string("<filter id='bl'><feGaussianBlur stdDeviation='1'/></filter>") +
            "<line x2='9' y2='9' stroke='white' filter='url(#bl)'/>",
        "<symbol id='sy'><rect width='3' height='3'/></symbol><use xlink:href='#sy' x='4'/>",
        text("letter-spacing='2' text-anchor='middle' font-weight='bold'"),
    };
    return kDrawn[below(kDrawn.size())];
  }

  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }

  std::mt19937 random_;
  std::set<std::string> expected_;
};

TEST(SvgLeftOut, IsNamedInAnyDrawingAndNothingElseIs) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Composer composer(seed);
    const std::string text = scene(composer.compose(3, seed % 4));
    const std::vector<std::string> named = drawn(text, 8).left_out;
    for (const std::string& expected : composer.expected()) {
      EXPECT_THAT(named, Contains(HasSubstr(expected))) << "seed " << seed << ": " << text;
    }
    if (composer.expected().empty()) {
      EXPECT_THAT(named, IsEmpty()) << text;
    }
  }
}

/// A JPEG, white in its left half, that is to be turned, as an address.
std::string jpeg_address(int orientation, const std::string& type = "image/jpeg") {
  const TempFolder folder;
  OIIO::ImageSpec spec(32, 32, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Orientation", orientation);
  std::vector<float> pixels(std::size_t{32} * 32 * 3, 0.0F);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = i / 3 % 32 < 16 ? 1.0F : 0.0F;
  lensforge::testing::write_raw(folder / "a.jpg", spec, pixels);
  return "data:" + type + ";base64," +
         OIIO::Strutil::base64_encode(lensforge::testing::read_bytes(folder / "a.jpg"));
}

std::string picture_at(const std::string& address) {
  return svg("<rect width='100' height='100'/><image width='100' height='100' xlink:href='" +
             address + "'/>");
}

TEST(SvgPictures, AreTurnedUprightAsExifSays) {
  // Where the left half goes: x and y of a place in it.
  const std::map<int, std::pair<int, int>> places{{1, {2, 8}},  {2, {13, 8}}, {3, {13, 8}},
                                                  {4, {2, 8}},  {5, {8, 2}},  {6, {8, 2}},
                                                  {7, {8, 13}}, {8, {8, 13}}};
  for (const auto& [orientation, place] : places) {
    const SvgPicture picture = drawn(picture_at(jpeg_address(orientation)), 16);
    EXPECT_NEAR(picture.light.at(place.first, place.second), 1.0F, 0.02) << orientation;
    EXPECT_NEAR(picture.light.at(15 - place.first, 15 - place.second), 0.0F, 0.02) << orientation;
    if (orientation > 1) {
      EXPECT_THAT(picture.remarks,
                  ElementsAre(HasSubstr("EXIF orientation " + std::to_string(orientation))));
    }
    EXPECT_THAT(picture.left_out, IsEmpty());
  }
}

TEST(SvgPictures, OfAnotherTypeThanTheyClaimAreDrawn) {
  const Image right = drawn(picture_at(jpeg_address(1)), 16).light;
  EXPECT_GT(right.total(), 100.0);
  for (const char* type : {"image/jpg", "image/png", "img/jpeg", ""}) {
    const SvgPicture picture = drawn(picture_at(jpeg_address(1, type)), 16);
    EXPECT_EQ(picture.light, right) << type;
    EXPECT_THAT(picture.left_out, IsEmpty()) << type;
  }
}

TEST(SvgPictures, ThatCannotBeTurnedAreNamed) {
  std::string wide;
  for (const char c : picture_at(jpeg_address(6))) wide += std::string{c, '\0'};
  EXPECT_THAT(drawn("\xFF\xFE" + wide, 16).left_out,
              ElementsAre(HasSubstr("the turn of a picture (EXIF orientation 6)")));
}

}  // namespace
}  // namespace lensforge::svg_left_out_test
