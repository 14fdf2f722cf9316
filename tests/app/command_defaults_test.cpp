// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "app/commands/cam_command.h"
#include "app/commands/design_command.h"
#include "app/commands/send_command.h"
#include "app/commands/settings.h"
#include "cam/plan/cam_options.h"
#include "core/schema/description.h"
#include "core/temp_folder.h"
#include "design/setup/design_options.h"

namespace lensforge::app {
namespace {

using testing::TempFolder;

/// Fails for every field that two structs differ in.
template <class Options>
void expect_equal(const Options& command, const Options& library) {
  const Description expected = description_of(library);
  for (const Field& field : description_of(command)) {
    EXPECT_EQ(field.get(), expected.at(field.name).get()) << field.name;
    EXPECT_EQ(field.fingerprint(), expected.at(field.name).fingerprint()) << field.name;
  }
}

/// As the command has them after an empty command line, but for what it cannot do without.
template <class Settings>
Settings parsed(const Arguments& needed, Settings settings = {}) {
  OptionSet options("command", "");
  options.fields(settings);
  options.parse(needed);
  return settings;
}

TEST(CommandDefaults, OfDesignAreTheLibrarysForEveryModelAndPicture) {
  for (const auto& [word, model] : named_models()) {
    for (const int side : {64, 512}) {
      const Image picture(side, side / 2, 0.5F);
      DesignSettings settings;
      OptionSet options("design", "");
      options.fields(settings);
      options.parse({"picture.png", "--out", "lens", "--model", word});
      settle(options, settings, picture, {});
      const DesignOptions library = default_design_options(model, picture);
      expect_equal(settings.design, library);
      expect_equal(settings.design.light, library.light);
      expect_equal(settings.design.weights, library.weights);
      EXPECT_EQ(library.weights.smooth, default_smoothness(model));
    }
  }
}

TEST(CommandDefaults, TheModelOfADesignFollowsFromItsSizeUnlessItIsGiven) {
  const auto model = [](int side, const Arguments& more) {
    DesignSettings settings;
    OptionSet options("design", "");
    options.fields(settings);
    Arguments arguments{"picture.png", "--out", "lens"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    options.parse(arguments);
    settle(options, settings, Image(side, side, 0.5F), {});
    EXPECT_EQ(options.used()["model"], model_name(settings.design.model));
    return settings.design.model;
  };
  EXPECT_EQ(model(1024, {}), SurfaceModel::kSpline);  // Of 256 pixels.
  EXPECT_EQ(model(1024, {"--pixels", "1024"}), SurfaceModel::kSmooth);
  EXPECT_EQ(model(1024, {"--pixels", "1024", "--model", "spline"}), SurfaceModel::kSpline);
  EXPECT_EQ(model(64, {"--model", "smooth"}), SurfaceModel::kSmooth);
}

TEST(CommandDefaults, OfDesignForTheDefaultModelAreTheStructs) {
  const DesignOptions library;
  expect_equal(default_design_options(library.model, Image(256, 256, 1.0F)), library);
  expect_equal(default_design_options(library.model, Image(256, 256, 1.0F)).weights,
               library.weights);
}

TEST(CommandDefaults, OfCamAreTheLibrarys) {
  CamSettings settings;
  OptionSet options("cam", "");
  options.fields(settings);
  options.parse({"/parts/lens"});
  settle(options, settings);
  expect_equal(settings.cam, CamOptions{});
  EXPECT_EQ(settings.cam.workshop, Workshop{});
  EXPECT_EQ(settings.cam.job, "lens");  // The folder's name.
}

/// But for rectangles, which come apart as well.
TEST(CommandDefaults, OfNestAreThoseOfCam) {
  NestSettings settings;
  OptionSet options("nest", "");
  options.fields(settings);
  options.parse({"/parts/bee", "/parts/bee/", "--blank", "200,100,8", "--out", "sheet"});
  settle(options, settings);
  CamOptions library;
  library.cut_outline = OutlineWish::kAlways;
  expect_equal(settings.nest.cam, library);
  EXPECT_EQ(settings.nest.blank, Eigen::Vector2d(200.0, 100.0));
  EXPECT_EQ(settings.nest.thickness, 8.0);
  EXPECT_EQ(settings.nest.gap, 0.0);
  EXPECT_EQ(nest_names(settings.sources), (std::vector<std::string>{"bee", "bee_2"}));
}

TEST(CommandDefaults, OfTheOtherCommandsAreTheLibrarys) {
  const auto exported = parsed<ExportSettings>({"lens", "--out", "a.step"});
  expect_equal(exported.options, ExportOptions{});
  const auto sent = parsed<SendSettings>({"a.ngc", "--port", "sim:grbl"});
  SendOptions library;
  library.port = "sim:grbl";
  expect_equal(sent.job, library);
  const auto coupon = parsed<CouponSettings>({"--out", "coupon"});
  expect_equal(coupon.coupon, CouponOptions{});
  const auto reflected = parsed<ReflectSettings>({"a.stl", "--out", "a"});
  expect_equal(reflected.reflect, reflect::ReflectOptions{});
  RenderOptions rendered;
  OptionSet options("render", "");
  options.fields(rendered);
  options.parse({});
  expect_equal(rendered, RenderOptions{});
}

TEST(CommandDefaults, WhatIsGivenWinsOverTheWorkshop) {
  const TempFolder folder;
  testing::write_bytes(folder / "shop.toml", "[finish]\npitch = 0.2\nscallop = 0.001\n");
  CamSettings settings;
  OptionSet options("cam", "");
  options.fields(settings);
  options.parse({"lens", "--workshop", (folder / "shop.toml").string(), "--pitch", "0.1",
                 "--tool-diameter", "0.8", "--no-rough"});
  settle(options, settings);
  const Process& process = settings.cam.workshop.process;
  EXPECT_EQ(process.finish.pitch, 0.1);
  EXPECT_EQ(process.finish.scallop, 0.0) << "the pitch that is given would be ignored";
  EXPECT_FALSE(process.rough.enabled);
  EXPECT_EQ(settings.cam.workshop.tool(process.finish.tool),
            resized(Workshop{}.tool(process.finish.tool), 0.8));
  EXPECT_EQ(options.used()["pitch"], 0.1);
  EXPECT_EQ(options.used()["scallop"], 0.0);
}

TEST(CommandDefaults, AWorkshopNeedsNoToolForWhatIsLeftOut) {
  CamOptions cam;
  std::erase_if(cam.workshop.tools,
                [&](const Tool& tool) { return tool.number != cam.workshop.process.finish.tool; });
  cam.workshop.process.rough.enabled = false;
  cam.workshop.process.semi.enabled = false;
  EXPECT_NO_THROW(validate(cam, OpticalSetup{}));
  for (const Field& field : description_of(cam)) {
    const bool none = std::holds_alternative<std::monostate>(field.get());
    EXPECT_EQ(none, field.name == "--rough-tool") << field.name;
  }
}

TEST(CommandDefaults, FactorsOnTheSmoothnessWorkInTheLibrary) {
  DesignSettings settings;
  OptionSet options("design", "");
  options.fields(settings);
  options.parse({"picture.png", "--out", "lens", "--model", "facet", "--smoothness", "3"});
  settle(options, settings, Image(64, 64, 0.5F), {});
  EXPECT_EQ(with_smoothness_applied(settings.design).weights.smooth,
            3.0 * default_smoothness(SurfaceModel::kFacet));
}

}  // namespace
}  // namespace lensforge::app
