// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_light.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "core/optics/refraction.h"

namespace lensforge {
namespace {

OpticalSetup setup() {
  OpticalSetup optics;
  optics.lens_size = {20.0, 16.0};
  optics.image_size = {20.0, 16.0};
  optics.pixels = {40, 32};
  optics.focal_length = 60.0;
  return optics;
}

/// Traced in the frame of lamp and screen, with both faces of the part turned.
Eigen::Vector2d traced(const OpticalSetup& optics, const PartError& error, Eigen::Vector3d p,
                       const Eigen::Vector2d& slope) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(error.tilt.y(), Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(error.tilt.x(), Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  const double ior = optics.ior + error.index;
  const Eigen::Vector3d centre(0.5 * optics.lens_size.x(), 0.5 * optics.lens_size.y(), 0.0);
  const Eigen::Vector3d face = turn * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d inside = refract(Eigen::Vector3d::UnitZ(), face, 1.0 / ior);
  const Eigen::Vector3d normal = turn * Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const Eigen::Vector3d out = refract(inside, normal, ior);
  p = centre + turn * (1.0 + error.expansion) * (p - centre);
  const Eigen::Vector3d at = p + (optics.focal_length + error.distance - p.z()) / out.z() * out;
  return ImagePlane(optics).to_pixels(at.head<2>());
}

TEST(PartLight, LandsWhereARayThroughTheTurnedPartDoes) {
  const OpticalSetup optics = setup();
  PartError error;
  error.tilt = {0.01, -0.02};
  error.index = 0.004;
  error.distance = 1.5;
  error.expansion = 3e-4;
  const PartLight light(optics, error);
  for (const double x : {0.0, 7.0, 20.0}) {
    for (const Eigen::Vector2d& slope : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.2, -0.1)}) {
      const Eigen::Vector2d place(x, 0.6 * x);
      const Eigen::Vector2d landed = light.land(light.grown(place, 5.0), slope);
      const Eigen::Vector2d expected = traced(optics, error, {x, 0.6 * x, 5.0}, slope);
      EXPECT_NEAR((landed - expected).norm(), 0.0, 1e-9);
    }
  }
}

PartError some_errors() {
  PartError error;
  error.tilt = {0.01, -0.02};
  error.index = 0.004;
  error.distance = 1.5;
  error.expansion = 3e-4;
  return error;
}

OpticalSetup with_tilted_screen(OpticalSetup optics) {
  optics.screen_x = {std::cos(0.4), 0.0, std::sin(0.4)};
  return optics;
}

/// Where a ray of the lamp's frame meets the screen, which is farther along its own axis.
Eigen::Vector2d caught(const OpticalSetup& optics, double farther, const Eigen::Vector3d& from,
                       const Eigen::Vector3d& way) {
  const Eigen::Vector3d axis = optics.screen_x.cross(optics.screen_y);
  const Eigen::Vector3d middle = optics.screen_centre() + farther * axis;
  const Eigen::Vector3d at = from + axis.dot(middle - from) / axis.dot(way) * way - middle;
  return ImagePlane(optics).to_pixels(
      optics.screen_centre().head<2>() +
      Eigen::Vector2d(at.dot(optics.screen_x), at.dot(optics.screen_y)));
}

TEST(PartLight, OfAPointLandsWhereARayThroughBothTurnedFacesDoes) {
  OpticalSetup optics = with_tilted_screen(setup());
  optics.lamp = PointSource{{8.0, 9.0, -200.0}, Emission::kIsotropic};
  const PartError error = some_errors();
  const PartLight light(optics, error);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(error.tilt.y(), Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(error.tilt.x(), Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  const double ior = optics.ior + error.index;
  const Eigen::Vector3d centre(10.0, 8.0, 0.0);
  for (const Eigen::Vector2d& aim : {Eigen::Vector2d(3.0, 4.0), Eigen::Vector2d(18.0, 1.0)}) {
    const Eigen::Vector3d source = lamp_place(optics.lamp).value();
    const Eigen::Vector3d front = centre + turn * (Eigen::Vector3d(aim.x(), aim.y(), 0.0) - centre);
    const Eigen::Vector3d inside = refract((front - source).normalized(), turn.col(2), 1.0 / ior);
    const Eigen::Vector3d out = front + 5.0 * inside;
    const Eigen::Vector2d slope(0.1, -0.05);
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    const Eigen::Vector3d way = refract(inside, turn * normal, ior);
    const Eigen::Vector3d point = centre + turn.transpose() * (out - centre);
    EXPECT_NEAR((light.land(point, slope) - caught(optics, error.distance, out, way)).norm(), 0.0,
                1e-9);
  }
}

TEST(PartLight, OfAMirrorLandsWhereARayFromTheTurnedMirrorDoes) {
  OpticalSetup optics = with_tilted_screen(setup());
  optics.body = MirrorBody{};
  const Eigen::Vector3d before(0.5, 0.0, -std::sqrt(0.75));
  optics.lamp = ParallelLight{before};
  optics.image_origin.x() = 30.0;
  const PartError error = some_errors();
  const PartLight light(optics, error);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(error.tilt.y(), Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(error.tilt.x(), Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  const Eigen::Vector3d centre(10.0, 8.0, 0.0);
  const Eigen::Vector3d place(3.0, 4.0, 5.0);
  const Eigen::Vector2d slope(0.05, -0.02);
  const Eigen::Vector3d n = turn * Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const Eigen::Vector3d way = before - 2.0 * before.dot(n) * n;
  const Eigen::Vector3d from = centre + turn * (1.0 + error.expansion) * (place - centre);
  const Eigen::Vector2d landed = light.land(light.grown(place.head<2>(), place.z()), slope);
  EXPECT_NEAR((landed - caught(optics, error.distance, from, way)).norm(), 0.0, 1e-9);
}

/// The light that goes through larger triangles is that which goes through many small ones
/// inside the same rim.
TEST(PartLight, TakesInWhatGoesThroughItsRim) {
  OpticalSetup optics = setup();
  optics.lamp = PointSource{{8.0, 9.0, -100.0}, Emission::kIsotropic};
  const PartLight light(optics, some_errors());
  const auto nodes_of = [](int cells) {
    PartNodes nodes{static_cast<std::size_t>(cells) + 1, {}};
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        const double x = 20.0 * i / cells;
        const double y = 16.0 * j / cells;
        const double inside = x * (20.0 - x) * y * (16.0 - y) / 6400.0;
        nodes.places.emplace_back(x, y, 5.0 + 0.02 * x + inside * std::sin(x));
      }
    }
    return nodes;
  };
  EXPECT_NEAR(light.whole(nodes_of(32)), light.whole(nodes_of(64)), 1e-6 * 320.0);
  EXPECT_NEAR(light.whole(nodes_of(32)), 320.0, 32.0);
}

/// Closed form: from a mirror under light at 30° that a flat one sends a way of L to the screen, a
/// direction φ aside lands φ L aside, and one φ along the plane of incidence φ L / cos 30°.
TEST(PartLight, ASourceOfAMirrorLightsAnEllipse) {
  OpticalSetup optics = setup();
  optics.body = MirrorBody{};
  optics.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  const double cosine = std::sqrt(0.75);
  optics.image_origin.x() = 55.0 * 0.5 / cosine;
  const Eigen::Vector2d radii = PartLight(optics, {}).source_radii(0.004, 5.0);
  const double way = 55.0 / cosine;
  EXPECT_NEAR(radii.y(), 2.0 * 0.002 * way, 1e-5);
  EXPECT_NEAR(radii.x(), 2.0 * 0.002 * way / cosine, 1e-5);
}

TEST(PartLight, WithoutErrorsIsTheLensesOwn) {
  const OpticalSetup optics = setup();
  const PartLight light(optics, {});
  const Eigen::Vector3d p(3.0, 4.0, 5.0);
  const Eigen::Vector2d slope(0.1, 0.05);
  const LightPath path(optics);
  const Eigen::Vector3d n = Eigen::Vector3d(-0.1, -0.05, 1.0).normalized();
  EXPECT_EQ(light.land(light.grown({3.0, 4.0}, 5.0), slope), path.land(p, path.beam(p, n).m));
  EXPECT_DOUBLE_EQ(light.whole({}), 320.0);
}

TEST(PartLight, TellsHowFarASlopeMovesLight) {
  const PartLight light(setup(), {});
  const Eigen::Vector3d p(3.0, 4.0, 5.0);
  const Eigen::Vector2d moved = light.moved_by(p, {0.0, 0.0}, 1);
  EXPECT_NEAR(std::abs(moved.y()), 2.0 * 0.49 * 55.0, 1e-4);
  EXPECT_NEAR(moved.x(), 0.0, 1e-9);
}

TEST(PartLight, LandsNothingThatIsReflectedTotally) {
  const PartLight light(setup(), {});
  EXPECT_FALSE(light.land({3.0, 4.0, 5.0}, {2.0, 0.0}).allFinite());
}

}  // namespace
}  // namespace lensforge
