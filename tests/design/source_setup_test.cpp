// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "core/error.h"
#include "core/temp_folder.h"
#include "design/schedule/checkpoint.h"
#include "design/setup/light_setup.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
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
              AllOf(StartsWith("--source-size 3mm: "), EndsWith("--source-angle 9.3 would do")));
  EXPECT_THAT(refusal([](LightOptions& o) {
                set_point(o);
                o.source_angle = 2.0;
              }),
              AllOf(StartsWith("--source-angle 2: "), EndsWith("--source-size 3mm would do")));
  EXPECT_THAT(refusal([](LightOptions& o) { o.source_angle = o.source_size = 2.0; }),
              EndsWith("leave one out"));
  EXPECT_THAT(refusal([](LightOptions& o) {
                o.source_shape = {1, 1, {1.0}};
              }),
              StartsWith("--source-picture: "));
}

TEST(SourceSetup, ASourceThatLeavesNoPictureIsRefusedWithOneThatDoes) {
  const std::string message = refusal([](LightOptions& o) { o.source_angle = 900.0; });
  EXPECT_THAT(message, AllOf(StartsWith("--source-angle 900: "), EndsWith("would do")));
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

}  // namespace
}  // namespace lensforge
