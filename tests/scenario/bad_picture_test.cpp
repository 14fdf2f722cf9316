// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>

#include <limits>
#include <memory>

#include "core/image/image_io.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

/// Pictures that `design` has to refuse without leaving anything behind.
class BadPicture : public Scenario {
 protected:
  void expect_refused(const std::string& name, const std::vector<std::string>& parts) {
    expect_refusal(run({"design", path(name), "--out", path("lens")}), 2, parts);
    EXPECT_FALSE(fs::exists(at("lens")));
  }

  void write_jpeg(const std::string& name) const {
    const OIIO::ImageSpec spec(96, 64, 3, OIIO::TypeDesc::UINT8);
    std::vector<unsigned char> pixels(spec.image_bytes());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = static_cast<unsigned char>(i * i % 251);
    }
    const auto output = OIIO::ImageOutput::create(path(name));
    ASSERT_TRUE(output && output->open(path(name), spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, pixels.data()) && output->close());
  }
};

TEST_F(BadPicture, MissingFile) { expect_refused("none.png", {"none.png"}); }

TEST_F(BadPicture, Folder) {
  fs::create_directory(at("folder.png"));
  expect_refused("folder.png", {"folder.png"});
}

TEST_F(BadPicture, TextFile) {
  write(at("letter.png"), "Dear reader, this is no picture.\n");
  expect_refused("letter.png", {"letter.png"});
}

TEST_F(BadPicture, EmptyFile) {
  write(at("empty.png"), "");
  expect_refused("empty.png", {"empty.png"});
}

TEST_F(BadPicture, TruncatedPng) {
  const std::string whole = content(picture("logo.png"));
  for (const double share : {0.01, 0.5, 0.99}) {
    const auto length = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
    write(at("cut.png"), whole.substr(0, length));
    expect_refused("cut.png", {"cut.png"});
  }
}

TEST_F(BadPicture, TruncatedJpeg) {
  write_jpeg("whole.jpg");
  const std::string whole = content(at("whole.jpg"));
  for (const double share : {0.05, 0.5, 0.95}) {
    const auto length = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
    write(at("cut.jpg"), whole.substr(0, length));
    expect_refused("cut.jpg", {"cut.jpg"});
  }
}

TEST_F(BadPicture, SvgThatEndsTooSoon) {
  write(at("cut.svg"), "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 3 2'><rect");
  expect_refused("cut.svg", {"cut.svg", "is no SVG that can be drawn"});
}

TEST_F(BadPicture, SvgWithoutAFontForItsText) {
  write(at("text.svg"),
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 30 20'>"
        "<text y='9' fill='white'>&#x10FF00;</text></svg>");
  expect_refused("text.svg", {"text.svg", "U+10FF00", "no installed font has"});
}

TEST_F(BadPicture, AllBlack) {
  write_image(Image(40, 30), at("black.png"));
  expect_refused("black.png", {"black"});
}

TEST_F(BadPicture, BlackOnNothingNamesTheBackgroundThatShowsIt) {
  const OIIO::ImageSpec spec(40, 30, 2, OIIO::TypeDesc::UINT8);
  std::vector<unsigned char> pixels(spec.image_bytes(), 0);
  for (std::size_t i = 1; i < pixels.size() / 2; i += 2) pixels[i] = 255;
  const auto output = OIIO::ImageOutput::create(path("logo.png"));
  ASSERT_TRUE(output && output->open(path("logo.png"), spec));
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, pixels.data()) && output->close());
  expect_refused("logo.png", {"logo.png", "black all over", "use --background white"});
  const Outcome info = run({"info", path("logo.png"), "--background", "white", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_DOUBLE_EQ(info.json()["mean"].get<double>(), 0.5);
  expect_refusal(run({"info", path("logo.png"), "--background", "grey"}), 2, {"#ffffff works"});
}

TEST_F(BadPicture, AThinOneNamesThePixelsThatWouldDo) {
  write_image(Image(1000, 8, 0.5F), at("thin.png"));
  expect_refused("thin.png", {"--pixels 256", "2 pixels", "--pixels 438 works"});
  write(at("thin.svg"),
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 1'>"
        "<rect width='60' height='1' fill='white'/></svg>");
  expect_refused("thin.svg", {"thin.svg", "256 x 3", "--pixels 359 works"});
}

TEST_F(BadPicture, OnePixel) {
  write_image(Image(1, 1, 0.5F), at("dot.png"));
  expect_refused("dot.png", {"1"});
}

TEST_F(BadPicture, NotANumber) {
  Image image(20, 20, 0.5F);
  image.at(3, 4) = std::numeric_limits<float>::quiet_NaN();
  write_image(image, at("nan.exr"));
  expect_refused("nan.exr", {"nan.exr"});
}

TEST_F(BadPicture, NegativeLight) {
  Image image(20, 20, 0.5F);
  image.at(3, 4) = -0.25F;
  write_image(image, at("negative.exr"));
  expect_refused("negative.exr", {"negative.exr"});
}

TEST_F(BadPicture, ThirtyThousandPixelsASide) {
  // The header alone: the size has to be refused before a pixel is read.
  write(at("huge.pgm"), "P5\n30000 30000\n255\n");
  expect_refused("huge.pgm", {"huge.pgm", "30000"});
}

TEST_F(BadPicture, OutputFolderThatIsAFile) {
  write(at("lens"), "a file");
  expect_refusal(run(small_design(picture("rings.png"), path("lens"))), 2, {"lens"});
  EXPECT_EQ(content(at("lens")), "a file");
}

TEST_F(BadPicture, OutputFolderThatCannotBeMade) {
  expect_refusal(run(small_design(picture("rings.png"), "/proc/lens")), 2, {"/proc/lens"});
  expect_refusal(run(small_design(picture("rings.png"), "/dev/null/lens")), 2, {"/dev/null/lens"});
}

TEST_F(BadPicture, OutputFolderWithALensIsLeftAlone) {
  fs::create_directory(at("lens"));
  write(at("lens/lens.json"), "{}");
  expect_refusal(run(small_design(picture("rings.png"), path("lens"))), 2,
                 {"--out", "holds a lens", "--resume", "--force"});
  EXPECT_EQ(content(at("lens/lens.json")), "{}");
  EXPECT_EQ(listing(at("lens")), std::vector<std::string>{"lens.json"});
}

TEST_F(BadPicture, ForceReplacesOnlyWhatCanBeReplaced) {
  fs::create_directory(at("lens"));
  write(at("lens/lens.json"), "{}");
  write_image(Image(40, 30), at("black.png"));
  expect_refusal(run({"design", path("black.png"), "--out", path("lens"), "--force"}), 2,
                 {"black"});
  EXPECT_EQ(content(at("lens/lens.json")), "{}");
}

}  // namespace
}  // namespace lensforge::scenario
