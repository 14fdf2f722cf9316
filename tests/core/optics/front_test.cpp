// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/front.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/optics/height_fronts.h"
#include "core/optics/light_path.h"
#include "core/optics/light_setups.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

// Fronts that are height maps: the spline itself, and its light against that of what it samples.

using testing::height_front;
using testing::Random;

const Eigen::Vector2d kSize(30.0, 24.0);

double wave(const Eigen::Vector2d& at) {
  return -1.0 + 0.4 * std::sin(0.5 * at.x()) * std::cos(0.4 * at.y() + 0.2);
}

/// All over the lens and 3 mm beyond its edges.
Eigen::Vector2d random_place(Random& random) {
  return {random.between(-3.0, kSize.x() + 3.0), random.between(-3.0, kSize.y() + 3.0)};
}

TEST(HeightFront, GoesThroughItsSamplesTheTopRowAtTheGreatestY) {
  HeightGrid grid{5, 4, {}};
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    grid.heights.push_back(static_cast<float>(random.between(-2.0, 0.0)));
  }
  const HeightFront map{std::make_shared<HeightSpline>(grid), kSize};
  const FrontSurface front(map);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) {
      const Eigen::Vector2d at(kSize.x() * column / 4.0, kSize.y() * (3 - row) / 3.0);
      const std::size_t number =
          5 * static_cast<std::size_t>(row) + static_cast<std::size_t>(column);
      const double sample = double{grid.heights[number]};
      EXPECT_NEAR(front.height(at), sample, 1e-14);
    }
  }
}

TEST(HeightFront, ItsDerivativesAreThoseOfItsHeights) {
  const HeightFront map = height_front(kSize, {40, 33}, wave);
  const FrontSurface front(map);
  constexpr double kStep = 1e-4;
  Random random(2);
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector2d at = random_place(random);
    const FrontPoint here = front.at(at);
    EXPECT_EQ(here.z, front.height(at));
    const FrontPoint east = front.at(at + Eigen::Vector2d(kStep, 0.0));
    const FrontPoint west = front.at(at - Eigen::Vector2d(kStep, 0.0));
    const FrontPoint north = front.at(at + Eigen::Vector2d(0.0, kStep));
    const FrontPoint south = front.at(at - Eigen::Vector2d(0.0, kStep));
    EXPECT_NEAR((east.z - west.z) / (2.0 * kStep), here.gradient.x(), 1e-8);
    EXPECT_NEAR((north.z - south.z) / (2.0 * kStep), here.gradient.y(), 1e-8);
    // At a knot their own slope jumps.
    const Eigen::Vector2d by_x = (east.gradient - west.gradient) / (2.0 * kStep);
    const Eigen::Vector2d by_y = (north.gradient - south.gradient) / (2.0 * kStep);
    EXPECT_NEAR(by_x.x(), here.bend[0], 1e-4);
    EXPECT_NEAR(by_x.y(), here.bend[1], 1e-4);
    EXPECT_NEAR(by_y.y(), here.bend[2], 1e-4);
  }
}

TEST(HeightFront, ItsSecondDerivativesAreContinuousAlsoAtItsEdges) {
  const GridShape shape{16, 13};  // Knots 2 mm apart.
  const HeightFront map = height_front(kSize, shape, wave);
  const FrontSurface front(map);
  constexpr double kBeside = 1e-9;
  for (int knot = -3; knot <= shape.columns + 2; ++knot) {
    const Eigen::Vector2d at(2.0 * knot, 7.3);
    const Eigen::Vector3d left = front.at(at - Eigen::Vector2d(kBeside, 0.0)).bend;
    const Eigen::Vector3d right = front.at(at + Eigen::Vector2d(kBeside, 0.0)).bend;
    EXPECT_LT((left - right).norm(), 1e-8) << knot;
  }
}

TEST(HeightFront, BeyondItsEdgesItsCurvatureFallsToNothingWithinOneSample) {
  const HeightFront map = height_front(kSize, {16, 13}, wave);
  const FrontSurface front(map);
  const double edge = front.at({30.0, 7.3}).bend[0];
  ASSERT_GT(std::abs(edge), 1e-3);
  EXPECT_NEAR(front.at({31.0, 7.3}).bend[0], 0.5 * edge, 1e-12);
  EXPECT_NEAR(front.at({32.0, 7.3}).bend[0], 0.0, 1e-12);
  EXPECT_NEAR(front.at({60.0, 7.3}).bend[0], 0.0, 1e-12);
  EXPECT_NEAR(front.at({60.0, 7.3}).z,
              front.at({32.0, 7.3}).z + 28.0 * front.at({32.0, 7.3}).gradient.x(), 1e-10);
}

/// Largest errors of height, slope and curvature against the sphere that a map samples.
Eigen::Array3d errors_of(const SphericalFront& sphere, const GridShape& shape) {
  const FrontSurface exact(sphere);
  const HeightFront samples =
      height_front(kSize, shape, [&](const Eigen::Vector2d& at) { return exact.height(at); });
  const FrontSurface map(samples);
  Random random(3);
  Eigen::Array3d worst = Eigen::Array3d::Zero();
  for (int k = 0; k < 3000; ++k) {
    const Eigen::Vector2d at(random.between(0.0, kSize.x()), random.between(0.0, kSize.y()));
    const FrontPoint a = exact.at(at);
    const FrontPoint b = map.at(at);
    worst = worst.max(Eigen::Array3d(std::abs(a.z - b.z), (a.gradient - b.gradient).norm(),
                                     (a.bend - b.bend).norm()));
  }
  return worst;
}

/// Of fourth order in the heights, third in the slopes, second in the curvatures, up to the edges.
TEST(HeightFront, AMapOfASphereConvergesToItByItsOrder) {
  const SphericalFront sphere = spherical_front(24.0, kSize);
  const Eigen::Array3d coarse = errors_of(sphere, {17, 14});
  const Eigen::Array3d fine = errors_of(sphere, {33, 27});
  const Eigen::Array3d ratio = coarse / fine;
  for (int k = 0; k < 3; ++k) RecordProperty("error" + std::to_string(k), std::to_string(fine[k]));
  EXPECT_NEAR(std::log2(ratio[0]), 4.0, 0.7);
  EXPECT_NEAR(std::log2(ratio[1]), 3.0, 0.7);
  EXPECT_NEAR(std::log2(ratio[2]), 2.0, 0.7);
}

/// The light of parallel rays and of a point, by the same sphere as a formula and as a map.
TEST(HeightFront, LightThroughAMapOfASphereIsThatThroughTheSphere) {
  for (const bool point : {false, true}) {
    OpticalSetup setup;
    setup.lens_size = kSize;
    setup.lamp = ParallelLight{Eigen::Vector3d(0.1, -0.05, 1.0).normalized()};
    if (point) setup.lamp = PointSource{{12.0, 10.0, -90.0}, Emission::kLambertian};
    const SphericalFront sphere = spherical_front(60.0, kSize);
    setup.front = sphere;
    const LightPath exact(setup);
    OpticalSetup mapped = setup;
    mapped.front = height_front(kSize, {121, 97}, [&](const Eigen::Vector2d& at) {
      return FrontSurface(sphere).height(at);
    });
    const LightPath map(mapped);
    Random random(4);
    for (int k = 0; k < 300; ++k) {
      // Light that enters beyond the edges meets another front.
      const Eigen::Vector3d p(random.between(2.0, 28.0), random.between(2.0, 22.0),
                              random.between(3.0, 6.0));
      const IncidentRay a = exact.ray_to(p);
      const IncidentRay b = map.ray_to(p);
      // Heights of 32 bits are 1e-7 mm off, on samples 0.25 mm apart.
      EXPECT_LT((a.m - b.m).norm(), 5e-7);
      EXPECT_LT((a.x - b.x).norm(), 6e-6);
      EXPECT_NEAR(a.z, b.z, 1e-6);
      EXPECT_LT((a.m_by_p - b.m_by_p).norm(), 2e-5);
      EXPECT_LT((a.x_by_p - b.x_by_p).norm(), 2e-4);
    }
  }
}

TEST(HeightFront, AViewOfACopyOfItsCoefficientsIsTheSameFront) {
  OpticalSetup setup;
  setup.lens_size = kSize;
  setup.front = height_front(kSize, {20, 17}, wave);
  const LightPath light(setup);
  const auto coefficients = light.front_coefficients();
  EXPECT_EQ(coefficients.size(), 24U * 21U);
  const std::vector<double> copy(coefficients.begin(), coefficients.end());
  const LightPath other = light.reading(copy.data());
  EXPECT_EQ(other.front_coefficients().data(), copy.data());
  EXPECT_EQ(other.ray_to({7.0, 8.0, 5.0}).m, light.ray_to({7.0, 8.0, 5.0}).m);
  setup.front.reset();
  EXPECT_TRUE(LightPath(setup).front_coefficients().empty());
}

/// A wedge turns light by its angle; waves on it do not move where the light goes as a whole.
TEST(HeightFront, ThePictureOfAWavyWedgeIsWhereTheWedgeSendsIt) {
  OpticalSetup setup;
  setup.lens_size = kSize;
  const auto chief = [&](double waves) {
    setup.front = height_front(kSize, {61, 49}, [&](const Eigen::Vector2d& at) {
      return 0.05 * (at.x() - kSize.x()) +
             waves * std::sin(8.0 * std::numbers::pi * at.x() / kSize.x() + 0.4);
    });
    return LightPath(setup).chief_slope(5.0);
  };
  // By angles: in along z, at the wedge's angle to its normal, out through the flat face.
  const double angle = std::atan(0.05);
  const double inside = angle - std::asin(std::sin(angle) / setup.ior);
  const double out = std::asin(setup.ior * std::sin(inside));
  EXPECT_NEAR(std::abs(chief(0.0).x()), std::tan(out), 1e-6);
  EXPECT_NEAR(chief(0.0).y(), 0.0, 1e-7);
  EXPECT_NEAR(chief(0.05).x(), chief(0.0).x(), 1e-4);
}

TEST(HeightFront, ItsFaultsAreFound) {
  OpticalSetup setup;
  setup.lens_size = kSize;
  const auto fault = [&](double amplitude, double z) {
    setup.front = height_front(kSize, {61, 49}, [&](const Eigen::Vector2d& at) {
      return -amplitude + amplitude * std::sin(2.0 * at.x());
    });
    return height_map_fault(setup, z);
  };
  // A crest of curvature 4 a focuses at n / ((n − 1) 4 a) = 0.76 / a behind it.
  EXPECT_FALSE(fault(0.1, 6.0).has_value());
  EXPECT_EQ(fault(0.1, 9.0), FrontFault::kFolds);
  EXPECT_EQ(fault(0.2, 6.0), FrontFault::kFolds);
  setup.lamp = ParallelLight{Eigen::Vector3d(1.0, 0.0, 0.1).normalized()};  // Slopes are up to 0.2.
  EXPECT_EQ(fault(0.1, 6.0), FrontFault::kUnlit);
}

TEST(HeightFront, ItsLowestPointIsFoundBetweenItsSamples) {
  const HeightFront front = height_front(kSize, {40, 33}, wave);
  const Eigen::AlignedBox2d box(Eigen::Vector2d(0.0, 0.0), kSize);
  EXPECT_NEAR(lowest_of(front, box), -1.4, 2e-3);
}

TEST(HeightFront, AMapAsideMovesTheLightByItsCurvature) {
  OpticalSetup setup;
  setup.lens_size = kSize;
  const SphericalFront sphere = spherical_front(140.0, kSize);
  setup.front = sphere;
  const double exact = shift_by_front(setup, {15.0, 12.0, 5.0});
  setup.front = height_front(
      kSize, {61, 49}, [&](const Eigen::Vector2d& at) { return FrontSurface(sphere).height(at); });
  EXPECT_NEAR(shift_by_front(setup, {15.0, 12.0, 5.0}), exact, 1e-3 * exact);
}

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
        const int row = k / 351;
        const Eigen::Vector2d at(0.1 * (k % 351), 0.1 * row);
        least = std::min(least, surface.height(box.min() + at));
      }
      EXPECT_NEAR(lowest_of(front, box), least, 1e-9);
    }
  }
}

}  // namespace

}  // namespace lensforge
