// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"
#include "core/optics/material.h"
#include "core/schema/description.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;

LightOptions lit_by(const std::string& lamp) {
  LightOptions light;
  set_lamp(light, lamp);
  return light;
}

std::string refusal(const std::string& lamp) {
  try {
    (void)lit_by(lamp);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Lamp, StandsForSourceSizeAndDistance) {
  EXPECT_EQ(lit_by("sun").source, SourceKind::kParallel);
  EXPECT_DOUBLE_EQ(lit_by("sun").source_angle, 9.3);
  const LightOptions led = lit_by("led:0.2in@1.5m");
  EXPECT_EQ(led.source, SourceKind::kPoint);
  EXPECT_EQ(led.emission, Emission::kLambertian);
  EXPECT_DOUBLE_EQ(led.source_size, 5.08);
  EXPECT_DOUBLE_EQ(led.source_distance, 1500.0);
  const LightOptions laser = lit_by("laser:633nm");
  EXPECT_DOUBLE_EQ(laser.source_angle, 0.0);
  EXPECT_DOUBLE_EQ(laser.wavelength_nm, 633.0);
  const LightOptions drawn = lit_by("a:b.png:2mrad");
  EXPECT_EQ(drawn.source_picture, "a:b.png");
  EXPECT_DOUBLE_EQ(drawn.source_angle, 2.0);
}

TEST(Lamp, IsBeforeTheMiddleOfTheLens) {
  DesignOptions options;
  options.width = 40.0;
  set_lamp(options.light, "led:3mm@600mm");
  const OpticalSetup setup = optical_setup(options, {64, 32});
  EXPECT_EQ(lamp_place(setup.lamp), Eigen::Vector3d(20.0, 10.0, -600.0));
  EXPECT_DOUBLE_EQ(setup.extent.width, 3.0);
}

TEST(Lamp, WhatIsNoneIsRefusedInOneLine) {
  EXPECT_THAT(refusal("candle"), HasSubstr("--lamp 'candle': must be sun, led:3mm@600mm"));
  EXPECT_THAT(refusal("led:3mm"), HasSubstr("must state diameter and distance"));
  EXPECT_THAT(refusal("led:3mm@-1"), HasSubstr("its distance from the lens must be"));
  EXPECT_THAT(refusal("led:0mm@1m"), HasSubstr("its diameter must be"));
  EXPECT_THAT(refusal("laser:9nm"), HasSubstr("its wavelength must be"));
  EXPECT_THAT(refusal("laser:green"), HasSubstr("its wavelength must be"));
  EXPECT_THAT(refusal("l.png:0mrad"), HasSubstr("its angle must be"));
}

TEST(Lamp, OptionsThatFollowWin) {
  DesignOptions options;
  Description d = description_of(options);
  d.add(description_of(options.light));
  d.at("--lamp").set(std::string("led:3mm@600mm"));
  d.at("--material").set(std::string("pc"));
  d.at("--ior").set(1.6);
  d.at("--source-size").set(5.0);
  EXPECT_DOUBLE_EQ(options.ior, 1.6);
  EXPECT_DOUBLE_EQ(options.light.source_size, 5.0);
  EXPECT_DOUBLE_EQ(options.light.source_distance, 600.0);
}

TEST(Lamp, ALasersMaterialHasTheIndexAtItsWavelength) {
  DesignOptions options;
  set_lamp(options.light, "laser:450nm");
  set_material("glass-bk7", options.light, options.ior, options.light.spectrum.abbe);
  EXPECT_DOUBLE_EQ(options.ior, material_named("glass-bk7", "").index(450.0));
}

TEST(Lamp, OfAFinishedLensIsReplaced) {
  DesignOptions options;
  OpticalSetup setup = optical_setup(options, {32, 32});
  put_lamp(lit_by("torch"), setup);
  EXPECT_EQ(lamp_place(setup.lamp), Eigen::Vector3d(50.0, 50.0, -1000.0));
  put_lamp(lit_by("sun"), setup);
  EXPECT_FALSE(lamp_place(setup.lamp));
  EXPECT_DOUBLE_EQ(setup.extent.width, 9.3e-3);
  options.light.body = MirrorBody{};
  options.light.incidence = 30.0;
  OpticalSetup mirror = optical_setup(options, {32, 32});
  EXPECT_THROW(put_lamp(lit_by("torch"), mirror), InputError);
}

}  // namespace
}  // namespace lensforge
