// SPDX-License-Identifier: GPL-3.0-or-later
// `lensforge check --lamp-from`: what is refused, and what a design takes of it.
#include <utility>

#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/temp_folder.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

class LampFrom : public Scenario {
 protected:
  /// A pinhole's image of a bar: 20 × 60 pixels of a photograph 200 wide.
  void photograph(const std::string& name, int left = 90, float light = 0.6F) const {
    Image image(200, 150, 0.05F);
    for (int r = 45; r < 105; ++r) {
      for (int c = left; c < left + 20; ++c) image.at(c, r) = light;
    }
    write_image(image, at(name));
  }
  [[nodiscard]] Arguments command(const Arguments& more) const {
    Arguments arguments{"check", "--out", path("lamp/of/torch")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  void expect_refused(const Arguments& more, const std::vector<std::string>& parts) const {
    expect_refusal(run(command(more)), 2, parts);
    EXPECT_FALSE(fs::exists(at("lamp")));
  }
  [[nodiscard]] Arguments scaled(const std::string& name) const {
    return {"--lamp-from", path(name), "--pinhole-distance", "500mm", "--photo-width", "100mm"};
  }
};

TEST_F(LampFrom, ScaleMissing) {
  photograph("wall.png");
  expect_refused({"--lamp-from", path("wall.png")}, {"--lamp-from", "--pinhole-distance 800mm"});
  expect_refused({"--lamp-from", path("wall.png"), "--photo-width", "9cm"},
                 {"--photo-width 200mm"});
}

TEST_F(LampFrom, SeveralPhotographs) {
  photograph("wall.png");
  place_small_lens(at("lens"));
  expect_refused({path("lens"), path("wall.png"), "--lamp-from", path("wall.png")},
                 {"PHOTO", "--lamp-from takes one photograph"});
}

TEST_F(LampFrom, OptionsOfAnotherKind) {
  photograph("wall.png");
  Arguments both = scaled("wall.png");
  both.insert(both.begin(), path("lens"));
  expect_refused(both, {"--pinhole-distance", "which has no lens"});
  expect_refused({path("lens"), path("wall.png"), "--lamp-distance", "3m"},
                 {"--lamp-distance", "is of --lamp-from"});
  Arguments fit = scaled("wall.png");
  fit.insert(fit.end(), {"--fit", path("shop.toml")});
  expect_refused(fit, {"--fit", "learns nothing of a workshop"});
  write(at("shop.toml"), "");
  Arguments shop = scaled("wall.png");
  shop.insert(shop.end(), {"--workshop", path("shop.toml")});
  expect_refused(shop, {"--workshop", "a pinhole has none"});
  expect_refused({path("wall.png")}, {"PHOTO is required"});
}

TEST_F(LampFrom, PhotographsWithoutAWholeLamp) {
  photograph("dark.png", 90, 0.05F);
  expect_refused(scaled("dark.png"), {"dark.png: shows no lamp"});
  photograph("clipped.png", 90, 1.0F);
  expect_refused(scaled("clipped.png"), {"clipped.png: ", "is clipped"});
  photograph("border.png", 180);
  expect_refused(scaled("border.png"), {"border.png: ", "touches the photograph's border"});
  photograph("wall.png");
  Arguments other = scaled("wall.png");
  write_image(Image(20, 15, 0.0F), at("dark.png"));
  other.insert(other.end(), {"--dark", path("dark.png")});
  expect_refused(other, {"--dark: has 20 × 15 pixels"});
}

/// The options that it names are those of a design.
TEST_F(LampFrom, ADesignTakesThePicture) {
  photograph("wall.png");
  Arguments arguments = command(scaled("wall.png"));
  arguments.emplace_back("--json");
  const Outcome measured = run(arguments);
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  // 60 of 200 pixels, 100 mm wide, at 500 mm.
  EXPECT_NEAR(measured.json()["lamp"]["angle_mrad"].get<double>(), 60.0, 0.5);
  Arguments design{"design",    picture("rings.png"),
                   "--out",     path("lens"),
                   "--pixels",  "16",
                   "--width",   "6mm",
                   "--focal",   "40mm",
                   "--quality", "draft"};
  const nlohmann::json options = measured.json()["next"]["design"];
  for (const auto& [name, value] : options.items()) {
    design.insert(design.end(), {"--" + name, value.get<std::string>()});
  }
  const Outcome designed = run(design);
  ASSERT_EQ(designed.exit_code, 0) << designed.err;
  const nlohmann::json lens = nlohmann::json::parse(testing::read_bytes(at("lens") / "lens.json"));
  const nlohmann::json shape = lens["source"]["shape"];
  ASSERT_GT(shape.size(), 8U);
  // The bar stands upright: a third as wide as it is high.
  const nlohmann::json& middle = shape[shape.size() / 2];
  EXPECT_GT(middle[middle.size() / 2].get<double>(), 0.8);
  EXPECT_LT(middle[1].get<double>(), 0.01);
}

TEST_F(LampFrom, ALampWithAPlaceHasASize) {
  photograph("wall.png");
  Arguments arguments = command(scaled("wall.png"));
  arguments.insert(arguments.end(), {"--lamp-distance", "2m", "--json"});
  const Outcome measured = run(arguments);
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_NEAR(measured.json()["lamp"]["size_mm"].get<double>(), 120.0, 1.0);
  const nlohmann::json options = measured.json()["next"]["design"];
  EXPECT_EQ(options["source"], "point");
  EXPECT_EQ(options["source-distance"], "2000mm");
  EXPECT_THAT(options["source-size"].get<std::string>(), HasSubstr("mm"));
}

}  // namespace
}  // namespace lensforge::scenario
