// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/optical_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The message for the default setup after `change`.
template <class Change>
std::string refusal(const Change& change) {
  OpticalSetup setup;
  change(setup);
  return message_of<InputError>([&] { validate(setup); });
}

TEST(OpticalSetup, TheDefaultIsValid) { validate(OpticalSetup{}); }

TEST(OpticalSetup, RefusesAnIndexNotAboveOne) {
  for (const double ior : {1.0, 0.9, -1.5, kInfinity, kNan}) {
    EXPECT_THAT(refusal([&](OpticalSetup& s) { s.ior = ior; }), ::testing::StartsWith("ior is "));
  }
}

TEST(OpticalSetup, RefusesAFocalLengthOfZeroNamingFieldValueAndRule) {
  EXPECT_EQ(refusal([](OpticalSetup& s) { s.focal_length = 0.0; }),
            "focal_length is 0: it must be a finite number of mm above 0");
}

TEST(OpticalSetup, RefusesSizesThatAreNotPositiveAndFinite) {
  for (const double size : {0.0, -3.0, kInfinity, kNan}) {
    EXPECT_THAT(refusal([&](OpticalSetup& s) { s.lens_size.y() = size; }),
                ::testing::StartsWith("lens_size[1] is "));
    EXPECT_THAT(refusal([&](OpticalSetup& s) { s.image_size.x() = size; }),
                ::testing::StartsWith("image_size[0] is "));
  }
}

TEST(OpticalSetup, RefusesAnOriginThatIsNotFinite) {
  EXPECT_THAT(refusal([](OpticalSetup& s) { s.image_origin.x() = kNan; }),
              ::testing::StartsWith("image_origin[0] is "));
}

TEST(OpticalSetup, RefusesLightThatIsNoUnitVectorTowardsTheLens) {
  for (const Eigen::Vector3d& light :
       {Eigen::Vector3d(0.0, 0.0, 2.0), Eigen::Vector3d(0.0, 0.0, -1.0),
        Eigen::Vector3d(kNan, 0.0, 1.0)}) {
    EXPECT_THAT(refusal([&](OpticalSetup& s) { s.lamp = ParallelLight{light}; }),
                ::testing::AllOf(::testing::StartsWith("light is "),
                                 ::testing::EndsWith("a unit vector towards +z")));
  }
}

TEST(OpticalSetup, RefusesAPictureWithoutPixels) {
  EXPECT_EQ(refusal([](OpticalSetup& s) { s.pixels.x() = 0; }),
            "pixels[0] is 0: it must be 1 or more");
}

}  // namespace
}  // namespace lensforge
