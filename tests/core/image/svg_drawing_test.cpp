// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/svg_drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/picture_refusal.h"
#include "core/stop_bound.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::picture_refusal;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Room for 255 levels of coverage and of colour.
constexpr double kLevel = 1.0 / 255.0;

const std::string kBlack = "<rect width='100%' height='100%'/>";

std::string svg(const std::string& content, const std::string& box = "0 0 8 4") {
  return "<svg xmlns='http://www.w3.org/2000/svg' "
         "xmlns:xlink='http://www.w3.org/1999/xlink' viewBox='" +
         box + "'>" + content + "</svg>";
}

/// As read_image() reads it.
LoadedImage drawn(const std::string& text, int side = 8) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", text);
  return read_image(folder / "a.svg", {}, side);
}

std::string refusal_of(const std::string& text) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", text);
  return picture_refusal(folder / "a.svg");
}

bool is_svg_text(const std::string& text) {
  std::istringstream stream(text);
  return is_svg(stream);
}

TEST(SvgDrawing, IsRecognisedByItsFirstElement) {
  EXPECT_TRUE(is_svg_text("<svg/>"));
  EXPECT_TRUE(
      is_svg_text("\xEF\xBB\xBF<?xml version='1.0'?>\n<!-- <a> -->\n"
                  "<!DOCTYPE svg [<!ENTITY a 'b>c'>]>\n<svg:svg xmlns:svg='x'>"));
  EXPECT_TRUE(is_svg_text("<!DOCTYPE svg PUBLIC 'a' 'b'>\n<svg\nwidth='1'>"));
  for (const char* other : {"", "svg", "<", "<html><svg/></html>", "<!-- <svg> ", "<svgx/>"}) {
    EXPECT_FALSE(is_svg_text(other)) << other;
  }
}

TEST(SvgDrawing, APixelIsTheMeanLightOverItsArea) {
  // White over the left 2.5 of 8 pixels, and grey over the lower half of a pixel.
  const LoadedImage loaded =
      drawn(svg(kBlack + "<rect width='2.5' height='4' fill='white'/>"
                         "<rect x='5' y='1.5' width='1' height='0.5' fill='#808080'/>"));
  ASSERT_EQ(loaded.image.columns(), 8);
  ASSERT_EQ(loaded.image.rows(), 4);
  EXPECT_EQ(loaded.image.at(0, 0), 1.0F);
  EXPECT_NEAR(loaded.image.at(2, 3), 0.5, kLevel);
  EXPECT_EQ(loaded.image.at(3, 0), 0.0F);
  EXPECT_NEAR(loaded.image.at(5, 1), 0.5 * decode(128.0 / 255.0), kLevel);
  EXPECT_THAT(loaded.changes, ::testing::ElementsAre("drawn at 8 x 4 pixels"));
}

TEST(SvgDrawing, ACircleHasItsArea) {
  const LoadedImage loaded =
      drawn(svg(kBlack + "<circle cx='50' cy='50' r='40' fill='white'/>", "0 0 100 100"), 200);
  EXPECT_NEAR(loaded.image.total(), std::numbers::pi * 80.0 * 80.0, 20.0);
}

TEST(SvgDrawing, ColourBecomesLuminanceAndTransparencyBlack) {
  const LoadedImage loaded =
      drawn(svg("<rect width='4' height='4' fill='lime'/>"
                "<rect x='4' width='4' height='4' fill='white' fill-opacity='0.4'/>"));
  EXPECT_NEAR(loaded.image.at(1, 1), 0.7152, 1e-6);
  EXPECT_NEAR(loaded.image.at(6, 1), 0.4, kLevel);
  EXPECT_THAT(loaded.changes, Contains(HasSubstr("luminance")));
  EXPECT_THAT(loaded.changes, Contains("transparency flattened onto black"));
}

TEST(SvgDrawing, CoverageIsOneWhereItHidesWhatIsBehind) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", svg("<rect width='3.5' height='4'/>"));
  const SvgPicture picture = draw_svg(folder / "a.svg", 8);
  EXPECT_EQ(picture.coverage.at(2, 1), 1.0F);
  EXPECT_NEAR(picture.coverage.at(3, 1), 0.5, kLevel);
  EXPECT_EQ(picture.coverage.at(4, 1), 0.0F);
  EXPECT_EQ(picture.light.total(), 0.0);
  EXPECT_FALSE(picture.colour);
}

TEST(SvgDrawing, KeepsItsProportions) {
  const TempFolder folder;
  const std::string area = "<rect width='30' height='20' fill='white'/>";
  write_bytes(folder / "a.svg",
              "<svg xmlns='http://www.w3.org/2000/svg' width='30mm' "
              "height='20mm' viewBox='0 0 30 20'>" +
                  area + "</svg>");
  write_bytes(folder / "b.svg", svg(area, "0 0 30 20"));
  write_bytes(folder / "c.svg",
              "<svg xmlns='http://www.w3.org/2000/svg' width='30' height='20'>" + area + "</svg>");
  for (const char* name : {"a.svg", "b.svg", "c.svg"}) {
    const Image drawing = draw_svg(folder / name, 300).light;
    EXPECT_EQ(drawing.columns(), 300) << name;
    EXPECT_EQ(drawing.rows(), 200) << name;
    EXPECT_NEAR(drawing.total(), 300.0 * 200.0, 0.01) << name;
    EXPECT_EQ(draw_svg(folder / name, 1).light.rows(), 1) << name;
  }
}

TEST(SvgDrawing, OpensNoFileThatItRefersTo) {
  const TempFolder folder;
  write_image(Image(8, 4, 1.0F), folder / "white.png");
  const auto image_of = [](const std::string& link) {
    return "<image width='8' height='4' xlink:href='" + link + "'/>";
  };
  const std::string absolute = "file://" + (folder / "white.png").string();
  write_bytes(folder / "a.svg", svg(kBlack + image_of("white.png") + image_of(absolute) +
                                    "<rect width='1' height='1' fill='red'/>"));
  const LoadedImage loaded = read_image(folder / "a.svg", {}, 8);
  EXPECT_NEAR(loaded.image.total(), 0.2126, 1e-6);
  EXPECT_THAT(loaded.changes, Contains(HasSubstr("left out 'white.png'")));
  EXPECT_THAT(loaded.changes, Contains(HasSubstr("left out 'file:///")));
}

TEST(SvgDrawing, RefusesTextOfOtherFiles) {
  const TempFolder folder;
  write_bytes(folder / "text.txt", "W");
  write_bytes(folder / "a.svg", "<!DOCTYPE svg [<!ENTITY e SYSTEM 'text.txt'>]>" +
                                    svg("<text y='4' fill='white'>&e;</text>"));
  EXPECT_THAT(picture_refusal(folder / "a.svg"), HasSubstr("Entity 'e' not defined"));
}

TEST(SvgDrawing, DrawsThePicturesInsideOfIt) {
  // One white pixel as PNG.
  const std::string pixel =
      "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEA"
      "sTj2FAAAAABJRU5ErkJggg==";
  const LoadedImage loaded =
      drawn(svg(kBlack + "<image width='4' height='4' xlink:href='" + pixel + "'/>"));
  EXPECT_NEAR(loaded.image.total(), 16.0, 0.5);
  EXPECT_THAT(loaded.changes, Not(Contains(HasSubstr("left out"))));
}

std::string text_in(const std::string& families, const std::string& text = "Words") {
  return svg("<g font-family=\"" + families + "\"><text y='4' fill='white'>" + text +
             "</text></g><rect width='1' height='1' fill='white'/>");
}

TEST(SvgDrawing, SaysWhichFontIsMissing) {
  for (const std::string& text :
       {text_in("NoSuchFontAnywhere"),
        svg("<style>text { fill: white; font-family: 'NoSuchFontAnywhere'; }</style>"
            "<text y='4'>W</text>"),
        svg("<text y='4' fill='white' style='x:y;font-family:NoSuchFontAnywhere'>W</text>"),
        svg("<text y='4' fill='white' style='font:bold 3px/1.5 NoSuchFontAnywhere'>W</text>"),
        svg("<text y='4' style='font-family:NoSuchFontAnywhere' font-family='serif' "
            "fill='white'>W</text>")}) {
    EXPECT_THAT(drawn(text).changes,
                Contains(AllOf(HasSubstr("'NoSuchFontAnywhere' is not installed"),
                               HasSubstr("convert the text to paths"))))
        << text;
  }
}

TEST(SvgDrawing, AFontThatIsThereOrNotUsedIsNotMissed) {
  for (const std::string& text :
       {text_in("NoSuchFontAnywhere, sans-serif"), text_in("DejaVu Sans"),
        svg("<text y='4' fill='white' style='font:700 3px \"NoSuchFontAnywhere\", serif'>W</text>"),
        svg("<path style='font-family:NoSuchFontAnywhere' fill='white' d='M0 0h4v4z'/>")}) {
    EXPECT_THAT(drawn(text).changes, Not(Contains(HasSubstr("installed")))) << text;
  }
}

TEST(SvgDrawing, RefusesTextThatNoInstalledFontHas) {
  // A place for private use beyond the Unicode's planes of scripts.
  EXPECT_THAT(refusal_of(text_in("serif", "a&#x10FF00;")),
              AllOf(HasSubstr("U+10FF00"), HasSubstr("no installed font has")));
}

TEST(SvgDrawing, RefusesWhatCannotBeDrawnInOneLine) {
  const std::string whole = svg("<rect width='3' height='4' fill='white'/>");
  EXPECT_THAT(refusal_of(whole.substr(0, whole.size() / 2)), HasSubstr("is no SVG"));
  EXPECT_THAT(refusal_of("<svg xmlns='http://www.w3.org/2000/svg'><g></svg>"),
              AllOf(HasSubstr("is no SVG"), Not(HasSubstr("\n"))));
  EXPECT_THAT(refusal_of("<svg xmlns='http://www.w3.org/2000/svg'><g/></svg>"),
              HasSubstr("give it a viewBox"));
  EXPECT_THAT(refusal_of(svg("", "0 0 0 0")), HasSubstr("has no size"));
  EXPECT_THAT(refusal_of(svg("<rect width='3' height='4'/>")), HasSubstr("is black all over"));
}

TEST(SvgDrawing, RefusesSizesThatNoPictureHas) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", svg("<rect width='3' height='4' fill='white'/>"));
  EXPECT_THAT(testing::message_of<InputError>([&] { read_image(folder / "a.svg", {}, 20'000); }),
              HasSubstr("at most 16384 a side"));
  write_bytes(folder / "b.svg", "<svg>");
  fs::resize_file(folder / "b.svg", kMaxSvgBytes + 1);
  EXPECT_THAT(picture_refusal(folder / "b.svg"), HasSubstr("b.svg"));
}

TEST(SvgDrawing, RefusesEntitiesThatGrowWithoutEnd) {
  std::string text = "<!DOCTYPE svg [<!ENTITY a0 'lolololololololol'>";
  for (int i = 1; i < 12; ++i) {
    const std::string below = "&a" + std::to_string(i - 1) + ";";
    text += "<!ENTITY a" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) text += below;
    text += "'>";
  }
  EXPECT_NE(refusal_of(text + "]>" + svg("<text fill='white'>&a11;</text>")), "");
}

/// Compresses it with gzip.
std::string packed(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
  std::string bytes(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  deflate(&stream, Z_FINISH);
  bytes.resize(stream.total_out);
  deflateEnd(&stream);
  return bytes;
}

std::string utf16(const std::string& text, bool little) {
  std::string bytes = little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) {
    bytes += little ? std::string{c, '\0'} : std::string{'\0', c};
  }
  return bytes;
}

TEST(SvgDrawing, PackedAndOtherwiseEncodedTextIsDrawnTheSame) {
  const std::string body = svg(kBlack + "<circle cx='3' cy='2' r='1.5' fill='white'/>");
  const Image plain = drawn(body).image;
  EXPECT_EQ(drawn(packed(body)).image, plain);
  for (const bool little : {true, false}) {
    EXPECT_EQ(drawn(utf16(body, little)).image, plain);
    EXPECT_EQ(drawn(utf16("<?xml version='1.0' encoding='UTF-16'?>" + body, little)).image, plain);
    EXPECT_EQ(drawn(packed(utf16(body, little))).image, plain);
  }
  for (const char* encoding : {"ISO-8859-1", "windows-1252", "Shift_JIS", "KOI8-R"}) {
    const std::string head = std::string("<?xml version='1.0' encoding='") + encoding + "'?>";
    EXPECT_EQ(drawn(head + body).image, plain) << encoding;
  }
  // An a with two dots.
  EXPECT_EQ(
      drawn("<?xml version='1.0' encoding='ISO-8859-1'?>" + text_in("DejaVu Sans", "\xE4")).image,
      drawn(text_in("DejaVu Sans", "\xC3\xA4")).image);
}

TEST(SvgDrawing, RefusesPackedTextThatIsTruncatedOrTooLong) {
  const std::string body = svg(kBlack + "<circle r='4' fill='white'/>");
  const std::string bytes = packed(body + std::string(2000, ' '));
  EXPECT_THAT(refusal_of(bytes.substr(0, bytes.size() - 9)), HasSubstr("truncated or corrupt"));
  EXPECT_THAT(refusal_of(packed(body + std::string(kMaxSvgBytes, ' '))),
              HasSubstr("unpacks to more than 32 MB"));
  EXPECT_THAT(refusal_of(packed("no drawing")), HasSubstr("is no picture"));
}

/// A file that keeps the libraries busy for longer than anybody waits.
std::string endless_line() { return text_in("DejaVu Sans", std::string(2'000'000, 'x')); }

/// A file that crashes them: their reader of selectors calls itself.
std::string deep_selector() {
  constexpr int kDeep = 20'000;
  std::string selector;
  for (int i = 0; i < kDeep; ++i) selector += ":not(";
  return svg("<style>" + selector + ".a" + std::string(kDeep, ')') + "{fill:red}</style>");
}

TEST(SvgDrawing, ACrashOfTheLibrariesIsARefusalInOneLine) {
  EXPECT_THAT(refusal_of(deep_selector()),
              AllOf(HasSubstr("cannot be drawn: the program that draws SVG"),
                    HasSubstr("use fewer or simpler elements")));
}

TEST(SvgDrawing, MemoryHasALimit) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "with the address sanitizer, which maps terabytes, children have no limit";
#endif
  // The result of each of these takes 64 MB.
  std::string floods;
  for (int i = 0; i < 100; ++i) {
    floods += "<feFlood flood-color='white' result='r" + std::to_string(i) + "'/>";
  }
  const TempFolder folder;
  write_bytes(folder / "a.svg", svg("<filter id='f' x='0' y='0' width='1' height='1'>" + floods +
                                        "</filter><rect width='8' height='8' filter='url(#f)'/>",
                                    "0 0 8 8"));
  EXPECT_THAT(testing::message_of<InputError>([&] { read_image(folder / "a.svg", {}, 1024); }),
              HasSubstr("needs more memory than is available"));
}

TEST(SvgDrawing, StopsAtOnceInTheMiddleOfAnything) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", endless_line());
  std::stop_source stop;
  std::jthread interrupt([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    stop.request_stop();
  });
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(read_image(folder / "a.svg", {stop.get_token(), {}}), Interrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - start,
            std::chrono::milliseconds(300) + lensforge::testing::kStopBound);
}

TEST(SvgDrawing, StopsWhenAskedTo) {
  const TempFolder folder;
  write_bytes(folder / "a.svg", svg("<rect width='3' height='4' fill='white'/>"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(read_image(folder / "a.svg", {stop.get_token(), {}}), Interrupted);
}

}  // namespace
}  // namespace lensforge
