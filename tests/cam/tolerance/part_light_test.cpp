// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_light.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

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

TEST(PartLight, WithoutErrorsIsTheLensesOwn) {
  const OpticalSetup optics = setup();
  const PartLight light(optics, {});
  const Eigen::Vector3d p(3.0, 4.0, 5.0);
  const Eigen::Vector2d slope(0.1, 0.05);
  const LightPath path(optics);
  const Eigen::Vector3d n = Eigen::Vector3d(-0.1, -0.05, 1.0).normalized();
  EXPECT_EQ(light.land(light.grown({3.0, 4.0}, 5.0), slope), path.land(p, path.beam(p, n).m));
  EXPECT_DOUBLE_EQ(light.lens_area(), 320.0);
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
