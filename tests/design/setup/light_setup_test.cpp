// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/temp_folder.h"
#include "design/schedule/checkpoint.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::StartsWith;

const Eigen::Vector2i kPixels(64, 48);

std::string refusal(const std::function<void(LightOptions&)>& change) {
  DesignOptions options;
  change(options.light);
  return message_of<InputError>([&] { require_light(options, kPixels); });
}

void set_point(LightOptions& o) {
  o.source = SourceKind::kPoint;
  o.source_position = {50.0, 37.5, -600.0};
}

TEST(SourceSetup, TheSetupHasTheOptionsAngleOrSize) {
  DesignOptions options;
  options.light.source_angle = 9.3;
  EXPECT_NEAR(optical_setup(options, kPixels).extent.width, 9.3e-3, 1e-15);
  options.light = {};
  set_point(options.light);
  options.light.source_size = 3.0;
  require_light(options, kPixels);
  EXPECT_EQ(optical_setup(options, kPixels).extent.width, 3.0);
}

TEST(SourceSetup, WhatDoesNotGoWithTheSourceIsRefusedWithWhatWould) {
  EXPECT_THAT(refusal([](LightOptions& o) { o.source_size = 3.0; }),
              AllOf(StartsWith("--source-size 3mm: "), EndsWith("--source-angle 9.3 works")));
  EXPECT_THAT(refusal([](LightOptions& o) {
                set_point(o);
                o.source_angle = 2.0;
              }),
              AllOf(StartsWith("--source-angle 2: "), EndsWith("--source-size 3mm works")));
  EXPECT_THAT(refusal([](LightOptions& o) { o.source_angle = o.source_size = 2.0; }),
              EndsWith("leave one out"));
  EXPECT_THAT(refusal([](LightOptions& o) {
                o.source_shape = {1, 1, {1.0}};
              }),
              StartsWith("--source-picture: "));
}

TEST(SourceSetup, ASourceThatLeavesNoPictureIsRefusedWithOneThatDoes) {
  const std::string message = refusal([](LightOptions& o) { o.source_angle = 900.0; });
  EXPECT_THAT(message, AllOf(StartsWith("--source-angle 900: "), EndsWith("works")));
  const std::size_t at = message.rfind("--source-angle ") + 15;
  DesignOptions narrower;
  narrower.light.source_angle = std::stod(message.substr(at));
  EXPECT_NO_THROW(require_light(narrower, kPixels));
  EXPECT_THAT(refusal([](LightOptions& o) {
                set_point(o);
                o.source_position->z() = -5.0;
                o.source_position->x() = 90.0;
                o.source_size = 100.0;
              }),
              StartsWith("--source-size 100mm: "));
}

TEST(SourceSetup, APictureOfASourceIsAveragedToFewPixels) {
  Image picture(40, 20);
  for (float& value : picture.values()) value = 0.25F;
  const SourceShape shape = shape_of(picture);
  EXPECT_EQ(shape.columns, kMaxShapeSide);
  EXPECT_EQ(shape.rows, kMaxShapeSide / 2);
  for (const double weight : shape.weights) EXPECT_NEAR(weight, 1.0, 1e-6);
  EXPECT_THAT(message_of<InputError>([] { shape_of(Image(4, 4)); }),
              StartsWith("--source-picture: is all black"));
}

TEST(SourceSetup, EveryFieldOfASourceReachesTheFingerprint) {
  const Image target(8, 8, 1.0F);
  DesignOptions options;
  const std::uint64_t none = design_fingerprint(target, options);
  options.light.source_angle = 2.0;
  const std::uint64_t disc = design_fingerprint(target, options);
  options.light.source_shape = {2, 1, {1.0, 0.5}};
  EXPECT_NE(none, disc);
  EXPECT_NE(disc, design_fingerprint(target, options));
}

std::string refusal(const std::function<void(DesignOptions&)>& change) {
  DesignOptions options;
  change(options);
  return message_of<InputError>([&] { require_light(options, kPixels); });
}

TEST(LightSetup, TheUsualScreenHasTheLensesPlaceAndSize) {
  const OpticalSetup setup = optical_setup({}, kPixels);
  EXPECT_EQ(setup.image_size, setup.lens_size);
  EXPECT_EQ(setup.image_origin, Eigen::Vector2d(0.0, 0.0));
  EXPECT_FALSE(setup.screen_is_turned());
}

TEST(LightSetup, AMirrorsPictureStandsWhereItsChiefRayLands) {
  DesignOptions options;
  options.light.body = MirrorBody{};
  options.light.incidence = 30.0;
  const OpticalSetup setup = optical_setup(options, kPixels);
  EXPECT_NEAR(setup.screen_centre().x(), 50.0 + 295.0 * std::tan(std::numbers::pi / 6.0), 1e-10);
  EXPECT_NEAR(setup.screen_centre().y(), 37.5, 1e-10);
  const OpticalSetup farther = at_focal_length(setup, 600.0, 5.0);
  EXPECT_NEAR(farther.screen_centre().x(), 50.0 + 595.0 * std::tan(std::numbers::pi / 6.0), 1e-10);
}

TEST(LightSetup, WidthAndOffsetPlaceThePicture) {
  DesignOptions options;
  options.light.image_width = 300.0;
  options.light.image_offset = {10.0, -20.0};
  const OpticalSetup setup = optical_setup(options, kPixels);
  EXPECT_EQ(setup.image_size, Eigen::Vector2d(300.0, 225.0));
  EXPECT_EQ(setup.screen_centre(), Eigen::Vector3d(60.0, 17.5, 300.0));
}

TEST(LightSetup, APositiveTiltBringsTheUpperEdgeTowardsTheViewer) {
  DesignOptions options;
  options.light.screen_tilt = {30.0, 0.0};
  EXPECT_NEAR(optical_setup(options, kPixels).screen_y.z(), -0.5, 1e-12);
  options.view = ViewSide::kRear;
  EXPECT_NEAR(optical_setup(options, kPixels).screen_y.z(), 0.5, 1e-12);
}

TEST(LightSetup, ASourceOnTheWrongSideIsRefusedWithAPlaceThatWorks) {
  const auto at = [](DesignOptions& o, double z) {
    o.light.source = SourceKind::kPoint;
    o.light.source_position = Eigen::Vector3d(50.0, 40.0, z);
  };
  EXPECT_THAT(refusal([&](DesignOptions& o) { at(o, 3.0); }),
              AllOf(StartsWith("--source-position 50,40,3: "), HasSubstr("50,37.5,-600 works")));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.source = SourceKind::kPoint; }),
              StartsWith("--source point: "));
  EXPECT_THAT(refusal([&](DesignOptions& o) {
                at(o, 4.0);
                o.light.body = MirrorBody{};
              }),
              StartsWith("--source-position 50,40,4: "));
  EXPECT_THAT(refusal([&](DesignOptions& o) {
                at(o, 900.0);
                o.light.body = MirrorBody{};
              }),
              HasSubstr("beyond the surface and the source"));
}

TEST(LightSetup, OptionsOfAnotherLightAreRefused) {
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.incidence = 20.0; }),
              StartsWith("--incidence 20"));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.emission = Emission::kLambertian; }),
              StartsWith("--emission lambertian"));
  EXPECT_THAT(
      refusal([](DesignOptions& o) { o.light.source_position = Eigen::Vector3d(0, 0, -9); }),
      StartsWith("--source-position 0,0,-9"));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.body = MirrorBody{}; }),
              AllOf(StartsWith("--mode reflect"), HasSubstr("--incidence 30 works")));
}

TEST(LightSetup, APictureOutOfReachIsRefused) {
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.image_offset = {900.0, 0.0};
              }),
              AllOf(StartsWith("--focal 300: "), HasSubstr("works")));
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.image_offset = {1e300, 0.0};
              }),
              StartsWith("--image-offset "));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.image_width = 0.5; }),
              AllOf(StartsWith("--image-width 0.5: "), HasSubstr("1mm works")));
}

TEST(LightSetup, AScreenThatNoLightReachesIsRefusedWithOneThatWorks) {
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.screen_tilt = {0.0, 81.0};
              }),
              StartsWith("--screen-tilt 0,81: "));
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.screen_tilt = {70.0, 70.0};
              }),
              StartsWith("--screen-tilt 70,70: "));
  const auto steep = [](DesignOptions& o) { o.light.screen_tilt = {0.0, 75.0}; };
  DesignOptions options;
  steep(options);
  options.focal_length = 50.0;
  const std::string message = message_of<InputError>([&] { require_light(options, kPixels); });
  const std::size_t at = message.find("--focal ");
  ASSERT_NE(at, std::string::npos) << message;
  options.focal_length = std::stod(message.substr(at + 8));
  EXPECT_NO_THROW(require_light(options, kPixels));
  options.focal_length /= 1.3;
  EXPECT_ANY_THROW(require_light(options, kPixels));
}

}  // namespace

}  // namespace lensforge
