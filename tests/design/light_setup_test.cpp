// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/setup/light_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::StartsWith;

const Eigen::Vector2i kPixels(64, 48);

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
  options.light.mode = LightMode::kReflect;
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
              AllOf(StartsWith("--source-position 50,40,3: "), HasSubstr("50,37.5,-600 would do")));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.source = SourceKind::kPoint; }),
              StartsWith("--source point: "));
  EXPECT_THAT(refusal([&](DesignOptions& o) {
                at(o, 4.0);
                o.light.mode = LightMode::kReflect;
              }),
              StartsWith("--source-position 50,40,4: "));
  EXPECT_THAT(refusal([&](DesignOptions& o) {
                at(o, 900.0);
                o.light.mode = LightMode::kReflect;
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
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.mode = LightMode::kReflect; }),
              AllOf(StartsWith("--mode reflect"), HasSubstr("--incidence 30 would do")));
}

TEST(LightSetup, APictureOutOfReachIsRefused) {
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.image_offset = {900.0, 0.0};
              }),
              AllOf(StartsWith("--focal 300: "), HasSubstr("would do")));
  EXPECT_THAT(refusal([](DesignOptions& o) {
                o.light.image_offset = {1e300, 0.0};
              }),
              StartsWith("--image-offset "));
  EXPECT_THAT(refusal([](DesignOptions& o) { o.light.image_width = 0.5; }),
              AllOf(StartsWith("--image-width 0.5: "), HasSubstr("1mm would do")));
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
