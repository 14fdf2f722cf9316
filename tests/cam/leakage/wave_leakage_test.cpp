// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>

#include "cam/analytic_fields.h"
#include "cam/leakage/leakage.h"
#include "cam/leakage/render_field.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {
namespace {

using testing::AnalyticField;
using testing::SurfacePoint;

constexpr double kWavelength = 550e-6;
constexpr double kPeriod = 0.018;  ///< Of the ripple: its orders land beside the lens's own light.
constexpr double kDepth = 30e-6;   ///< mm

/// A flat lens of 2 mm before a wall of 10 mm × 4 mm, 75 mm away.
FieldRenderSetup ripple_setup() {
  FieldRenderSetup setup;
  setup.optics.lens_size = {2.0, 2.0};
  setup.optics.image_size = {10.0, 4.0};
  setup.optics.image_origin = {-4.0, -1.0};
  setup.optics.pixels = {100, 40};
  setup.optics.focal_length = 80.0;
  setup.grid = lens_grid(setup.optics.lens_size, {kPeriod / 8.0, 0.02});
  setup.surface_height = 5.0;
  return setup;
}

SurfacePoint ripple(const Eigen::Vector2d& p) {
  const double k = 2.0 * std::numbers::pi / kPeriod;
  return {5.0 + kDepth * std::sin(k * p.x()), {k * kDepth * std::cos(k * p.x()), 0.0}, 0};
}

/// Light on the wall beside the lens's own.
double beside(const FluxPicture& picture) {
  double sum = 0.0;
  for (std::size_t k = 0; k < picture.flux.size(); ++k) {
    const std::size_t column = k % 100;
    if (column < 39 || column >= 61) sum += picture.flux[k];
  }
  return sum;
}

/// A ripple's light goes to orders of J₁² each, whatever its slopes; rays follow its slopes and put
/// many times as much astray.
TEST(WaveLeakage, OfARippleIsInItsOrders) {
  const AnalyticField flat(testing::plane({0.0, 0.0}), false);
  const AnalyticField rippled(ripple, false);
  LeakageChain chain;
  chain.designed = {"designed", &flat};
  chain.steps = {{leak_cause::kPolish, &flat}, {leak_cause::kScallop, &rippled}};
  const FieldRenderSetup setup = ripple_setup();
  const Image target = render_field(flat, setup, Executor::serial(), RunControl()).image(4000.0);
  const LeakageResult rays =
      measure_leakage(chain, target, setup, {}, Executor::serial(), RunControl());
  // Twice the orders' angle: on a lens this small what the rim sends there counts.
  chain.waves = {kWavelength, Eigen::Vector2d::Constant(2.0 * kWavelength / kPeriod),
                 &rays.designed};
  const WaveLeakage waves = measure_waves(chain, target, setup, {}, Executor::cpu(2), RunControl());
  const double phase = 2.0 * std::numbers::pi * (setup.optics.ior - 1.0) * kDepth / kWavelength;
  const double orders = 2.0 * std::pow(std::cyl_bessel_j(1, phase), 2);
  const LeakageResult& result = waves.result;
  EXPECT_NEAR(beside(result.part().picture) - beside(result.designed.picture), orders,
              0.02 * orders);
  // Where the rim's light and an order's interfere, a pixel more is leakage, one less is none.
  EXPECT_NEAR(result.part().quality.leakage, orders, 0.03 * orders);
  EXPECT_GT(rays.part().quality.leakage, 3.0 * orders);
  ASSERT_EQ(result.parts.size(), 3U);
  EXPECT_EQ(result.parts[0].cause, leak_cause::kDiffraction);
  EXPECT_EQ(result.parts[0].leakage, 0.0);
  EXPECT_GT(result.parts[0].dark_flux, 1e-3);  // The rim's.
  EXPECT_EQ(result.parts[1].leakage, 0.0);
  EXPECT_EQ(result.parts[2].leakage, result.part().quality.leakage);
  EXPECT_NEAR(waves.width, std::sqrt(kWavelength * 75.0), 1e-9);
}

TEST(LightChoice, GoesByTheLampAndTheSurface) {
  FieldRenderSetup setup = ripple_setup();
  const auto choice = [&](LightModel asked, bool creased) {
    return light_choice(setup, asked, creased, kWavelength);
  };
  EXPECT_TRUE(choice(LightModel::kAuto, false).waves);
  EXPECT_FALSE(choice(LightModel::kAuto, true).waves);
  EXPECT_FALSE(choice(LightModel::kRays, false).waves);
  // An image of 0.3 mm, and one of the sun, 0.7 mm.
  setup.optics.extent = SourceExtent{0.004, {}};
  EXPECT_TRUE(choice(LightModel::kAuto, false).waves);
  setup.optics.extent = SourceExtent{0.0093, {}};
  EXPECT_FALSE(choice(LightModel::kAuto, false).waves);
  EXPECT_EQ(choice(LightModel::kAuto, false).words,
            "by rays: the lamp's image is 7.0 pixels wide, and diffraction blurs 2.0");
  EXPECT_TRUE(choice(LightModel::kWaves, false).waves);
}

TEST(WaveLeakage, HazeIsOnThePictureByWaves) {
  const AnalyticField flat(testing::plane({0.0, 0.0}), false);
  const FieldRenderSetup setup = ripple_setup();
  const Haze haze = haze_of({10.0, 5.0}, setup.optics, 5.0, kWavelength);
  LeakageChain chain{{"designed", &flat}, {{leak_cause::kPolish, &flat}}, {{"polished", &flat}}};
  chain.haze = &haze;
  const Image target = render_field(flat, setup, Executor::serial(), RunControl()).image(4000.0);
  const LeakageResult rays =
      measure_leakage(chain, target, setup, {}, Executor::serial(), RunControl());
  chain.waves = {kWavelength, {0.0, 0.0}, &rays.designed};
  const LeakageResult waves =
      measure_waves(chain, target, setup, {}, Executor::cpu(2), RunControl()).result;
  for (const LeakageResult* result : {&rays, &waves}) {
    EXPECT_EQ(result->parts.back().cause, leak_cause::kHaze);
    EXPECT_EQ(result->part().picture.flux,
              hazed(haze, result->designed.picture.flux, setup.optics.pixels, Executor::serial()));
    EXPECT_EQ(result->others[0].picture.flux, result->part().picture.flux);
  }
}

}  // namespace
}  // namespace lensforge
