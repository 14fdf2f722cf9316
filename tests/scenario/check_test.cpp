// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

/// Photographs that tell nothing are refused before the rows are planned, and leave nothing behind.
class BadPhotograph : public Scenario {
 protected:
  BadPhotograph() { place_small_lens(at("lens")); }

  /// A dim wall with a square of light. @param light  1 is white.
  void photograph(const std::string& name, float wall, float light, int side = 60) const {
    Image image(side, side, wall);
    for (int r = side / 3; r < 2 * side / 3; ++r) {
      for (int c = side / 3; c < 2 * side / 3; ++c) image.at(c, r) = light;
    }
    write_image(image, at(name));
  }
  void expect_refused(const Arguments& photos, const std::vector<std::string>& parts) const {
    Arguments arguments = {"check", path("lens")};
    arguments.insert(arguments.end(), photos.begin(), photos.end());
    arguments.insert(arguments.end(), {"--out", path("check")});
    expect_refusal(run(arguments), 2, parts);
    EXPECT_FALSE(fs::exists(at("check")));
  }
};

TEST_F(BadPhotograph, Missing) { expect_refused({path("none.png")}, {"none.png"}); }

TEST_F(BadPhotograph, NoPicture) {
  write(at("letter.png"), "Dear reader, this is no picture.\n");
  expect_refused({path("letter.png")}, {"letter.png"});
}

TEST_F(BadPhotograph, TooDark) {
  photograph("wall.png", 0.002F, 0.01F);
  expect_refused({path("wall.png")}, {"wall.png: is too dark", "must be 2 % or more"});
}

TEST_F(BadPhotograph, Clipped) {
  photograph("wall.png", 0.1F, 1.0F);
  expect_refused({path("wall.png")}, {"wall.png: ", "is clipped, at most 35 %"});
}

TEST_F(BadPhotograph, NothingOnTheWall) {
  photograph("wall.png", 0.3F, 0.3F);
  expect_refused({path("wall.png")}, {"wall.png: shows no picture of the lens"});
}

TEST_F(BadPhotograph, AnotherSizeInTheDark) {
  photograph("wall.png", 0.1F, 0.6F);
  photograph("dark.png", 0.1F, 0.1F, 30);
  expect_refused({path("wall.png"), "--dark", path("dark.png")},
                 {"--dark: has 30 × 30 pixels, the photograph 60 × 60"});
}

TEST_F(BadPhotograph, DarkOfSeveralExposures) {
  photograph("wall.png", 0.1F, 0.6F);
  expect_refused({path("wall.png"), path("wall.png"), "--dark", path("wall.png")},
                 {"--dark", "belongs to one exposure"});
}

/// Before the rows are planned.
TEST_F(BadPhotograph, FitWouldReplaceAFileOfTheUsers) {
  photograph("wall.png", 0.1F, 0.6F);
  write(at("shop.toml"), "# mine\n");
  expect_refused({path("wall.png"), "--fit", path("shop.toml")}, {"--fit", "shop.toml", "--force"});
}

class ChartForTheWall : public Scenario {
 protected:
  void expect_no_chart(Arguments arguments, const std::vector<std::string>& parts) const {
    arguments.insert(arguments.begin(), "check");
    expect_refusal(run(arguments), 2, parts);
    EXPECT_FALSE(fs::exists(at("chart.svg")));
  }
};

TEST_F(ChartForTheWall, IsWrittenAndReplaced) {
  const Arguments twice = {"check", "--chart", path("chart.svg"), "--chart-bar", "80mm"};
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(run(twice).exit_code, 0);
    EXPECT_NE(content(at("chart.svg")).find(">80 mm<"), std::string::npos);
  }
  write(at("chart.svg"), "<svg>mine</svg>");
  expect_refusal(run(twice), 2, {"--chart", "chart.svg", "--force"});
}

TEST_F(ChartForTheWall, NeedsAPlace) {
  write(at("file"), "no folder");
  expect_no_chart({"--chart", path("file/chart.svg")}, {"file"});
  expect_no_chart({path("lens"), "--chart", path("chart.svg")}, {"LENS", "--chart"});
  expect_no_chart({"--chart", path("chart.svg"), "--chart-bar", "0mm"},
                  {"--chart-bar", "must be 1 to 1000"});
}

TEST_F(ChartForTheWall, WithoutItACheckNeedsItsFiles) {
  expect_no_chart({}, {"--out is required"});
  expect_no_chart({path("lens"), "--out", path("check")}, {"PHOTO is required"});
  expect_no_chart({"--out", path("check")}, {"LENS is required"});
}

}  // namespace
}  // namespace lensforge::scenario
