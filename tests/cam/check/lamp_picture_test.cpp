// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/lamp_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "cam/check/drawn_lamp.h"
#include "cam/check/virtual_wall.h"
#include "core/error.h"

namespace lensforge::lamp_picture_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using virtual_wall::Camera;
using virtual_wall::DrawnLamp;

constexpr double kDistance = 800.0;

/// A camera straight before a pinhole's image, with what its photograph shows of the wall.
struct Shot {
  Image photo;
  Pinhole hole;
};

/// @param across  of the wall's widths that the camera sees.
Shot shot(const DrawnLamp& lamp, Camera camera, double across = 1.2, bool lit = true) {
  const virtual_wall::WallLight wall = virtual_wall::pinhole_light(lamp, kDistance, 1.0);
  camera.away = across * camera.focal;
  camera.yaw = camera.pitch = camera.roll = camera.k1 = camera.k2 = 0.0;
  return {virtual_wall::photograph(wall, wall.size, camera, lit),
          {kDistance, across * wall.size.x()}};
}

LampPicture lamp_of(const Shot& one) {
  return lamp_by_pinhole(photograph(one.photo, {}, "wall.jpg"), one.hole);
}

std::string refusal_of(const Image& photo) {
  try {
    lamp_by_pinhole(photograph(photo, {}, "wall.jpg"), {kDistance, 50.0});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A dim wall with a square of light.
Image square_of(float wall, float light, int from, int to) {
  constexpr int kSide = 100;
  Image image(kSide, kSide, wall);
  for (int r = from; r < to; ++r) {
    for (int c = from; c < to; ++c) image.at(c, r) = light;
  }
  return image;
}

/// None of the lamps has a symmetry that would hide a flip.
TEST(LampPicture, APinholeShowsTheLampAsSeenFromTheHole) {
  for (const auto& [name, lamp] : virtual_wall::drawn_lamps(0.03)) {
    SCOPED_TRACE(name);
    const LampPicture found = lamp_of(shot(lamp, virtual_wall::any_camera(3)));
    const virtual_wall::LampMatch match = virtual_wall::match(found, lamp);
    EXPECT_GT(match.correlation, 0.995);
    EXPECT_LT(match.mae, 0.01);
    EXPECT_NEAR(match.width, 1.0, 0.02);
    EXPECT_LT(found.lit * found.width, 1.1 * lamp.width);
  }
}

TEST(LampPicture, ARoomsLightIsNoLamp) {
  Camera camera;
  camera.ambient = 0.15;
  camera.slope = 0.6;
  const DrawnLamp lamp = virtual_wall::drawn_lamps(0.03).front().second;
  const Shot one = shot(lamp, camera);
  EXPECT_GT(virtual_wall::match(lamp_of(one), lamp).correlation, 0.99);
  // With a photograph in the dark it may be any light.
  const Image dark = shot(lamp, camera, 1.2, false).photo;
  const LampPicture found = lamp_by_pinhole(photograph(one.photo, dark, "wall.jpg"), one.hole);
  EXPECT_GT(virtual_wall::match(found, lamp).correlation, 0.99);
}

TEST(LampPicture, RefusesPhotographsWithoutAWholeLamp) {
  EXPECT_EQ(refusal_of(square_of(0.05F, 0.6F, 40, 60)), "");
  EXPECT_THAT(refusal_of(square_of(0.001F, 0.01F, 40, 60)),
              StartsWith("wall.jpg: is too dark: the brightest wall has 1 % of white"));
  EXPECT_THAT(refusal_of(square_of(0.05F, 1.0F, 40, 60)),
              StartsWith("wall.jpg: 100.0 % of the lamp's image is clipped"));
  EXPECT_THAT(refusal_of(square_of(1.0F, 1.0F, 40, 60)), HasSubstr("is clipped"));
  EXPECT_THAT(refusal_of(square_of(0.3F, 0.3F, 40, 60)), StartsWith("wall.jpg: shows no lamp"));
  EXPECT_THAT(refusal_of(square_of(0.05F, 0.6F, 90, 100)),
              HasSubstr("touches the photograph's border"));
  EXPECT_THAT(refusal_of(square_of(0.05F, 0.6F, 40, 45)), HasSubstr("is 5 pixels wide"));
}

/// The lamp is a sum of points on the virtual wall, a convolution in the search; the lens was made
/// for a disc a tenth as wide.
TEST(LampPicture, ALensShowsTheLampBehindIt) {
  const Lens lens = virtual_wall::steep_lens(2.0);
  const CamOptions options = virtual_wall::light_by(LightModel::kRays);
  const Executor executor = Executor::cpu(2);
  const virtual_wall::Workshop workshop(lens, options, executor);
  const auto photo = [&](const virtual_wall::WallLight& light) {
    return photograph(
        virtual_wall::photograph(light, lens.setup.image_size, virtual_wall::any_camera(1)), {},
        "wall.jpg");
  };
  const DrawnLamp lamp = virtual_wall::drawn_lamps(0.05).back().second;
  const LampPicture found =
      lamp_by_lens(lens, options, photo(workshop.light({}, lamp)), executor, {});
  const virtual_wall::LampMatch match = virtual_wall::match(found, lamp);
  EXPECT_GT(match.correlation, 0.98);
  EXPECT_LT(match.mae, 0.02);
  EXPECT_NEAR(match.width, 1.0, 0.03);
  EXPECT_LT(found.residual, 0.01);
  // The lens's own is narrower than what the photograph resolves.
  try {
    lamp_by_lens(lens, options, photo(workshop.light({})), executor, {});
    ADD_FAILURE() << "shows a lamp";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("pixels wide, must be 3 or more"));
  }
}

}  // namespace
}  // namespace lensforge::lamp_picture_test
