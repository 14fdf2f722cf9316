// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/optics/front.h"
#include "core/optics/light_setups.h"

namespace lensforge {
namespace {

/// To first order light inside has a slope of −φ times its place on the front, φ = (η − 1)/(ηR); a
/// front that lies aside by δ turns what comes to a point at height t above it by φδ/(1 − tφ).
TEST(FrontPlacement, AFrontAsideMovesTheLightByItsPower) {
  for (const double radius : {140.0, -160.0}) {
    OpticalSetup setup;
    const SphericalFront front = spherical_front(radius, setup.lens_size);
    setup.front = front;
    const double shift = shift_by_front(setup, {50.0, 50.0, 10.0});
    const double phi = (setup.ior - 1.0) / (setup.ior * radius);
    const double t = 10.0 - front.apex.z();
    const double turn = setup.ior * phi / (1.0 - t * phi);
    EXPECT_NEAR(shift / (std::abs(turn) * (setup.focal_length - 10.0)), 1.0, 1e-6);
  }
}

TEST(FrontPlacement, TheLowestPointIsThatOfManyPlaces) {
  const Eigen::AlignedBox2d box(Eigen::Vector2d(-5.0, 2.0), Eigen::Vector2d(30.0, 20.0));
  for (const double radius : {70.0, -70.0}) {
    for (const Eigen::Vector2d& apex : {Eigen::Vector2d(12.0, 4.0), {-9.0, 30.0}, {40.0, 10.0}}) {
      const SphericalFront front{radius, {apex.x(), apex.y(), -3.0}};
      const FrontSurface surface(front);
      double least = 1e9;
      for (int k = 0; k < 351 * 181; ++k) {
        const Eigen::Vector2d at(k % 351 * 0.1, k / 351 * 0.1);
        least = std::min(least, surface.height(box.min() + at));
      }
      EXPECT_NEAR(lowest_of(front, box), least, 1e-9);
    }
  }
}

}  // namespace
}  // namespace lensforge
