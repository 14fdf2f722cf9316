// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_job.h"
#include "cam/coupon/coupon_simulation.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using testing::CouponSimulation;
using testing::TempFolder;
using testing::TrueWorkshop;

/// A workshop that is not as its file says.
constexpr TrueWorkshop kTrue{0.036, 0.2075, 8e-4, 0.006};

/// Readings of the default coupon in that workshop, without noise.
CouponReadings simulated(const CouponOptions& options, const TrueWorkshop& shop) {
  const TempFolder folder;
  const CouponResult coupon = make_coupon(options, folder.path(), Executor::serial(), {});
  EXPECT_TRUE(coupon.done());
  const CouponSimulation simulation(coupon.files.front(), options.post, coupon.layout, shop);
  return simulation.measured(expected_readings(coupon.layout, options.workshop));
}

Workshop true_workshop(Workshop workshop, const TrueWorkshop& shop = kTrue) {
  workshop.polish.sigma = shop.sigma;
  workshop.polish.order = shop.order;
  workshop.polish.floor = shop.floor;
  workshop.process.finish.pitch_error = shop.pitch_error;
  for (Tool& tool : workshop.tools) {
    if (tool.number == workshop.process.finish.tool) tool.diameter = 2.0 * shop.radius;
  }
  return workshop;
}

TEST(CouponRoundTrip, ExactReadingsGiveTheTrueWorkshop) {
  const CouponOptions options;
  const CouponFit fit = fit_coupon(simulated(options, kTrue), options.workshop, "readings");
  EXPECT_NEAR(fit.sigma.value, kTrue.sigma, 0.1 * fit.sigma.uncertainty);
  EXPECT_NEAR(fit.diameter.value, 2.0 * kTrue.radius, 0.1 * fit.diameter.uncertainty);
  EXPECT_NEAR(fit.pitch_error.value, kTrue.pitch_error, 0.1 * fit.pitch_error.uncertainty);
  EXPECT_NEAR(fit.touch_off.value, kTrue.touch_off, 2e-4);
  EXPECT_LT(fit.chi_square, 0.05);
  // As exact as it is useful.
  EXPECT_LT(fit.sigma.uncertainty, 0.02 * kTrue.sigma);
  EXPECT_LT(fit.diameter.uncertainty, 0.01 * 2.0 * kTrue.radius);
  EXPECT_LT(fit.pitch_error.uncertainty, 1e-3);
}

/// Errors of the fitted values follow the uncertainties that are stated for them.
TEST(CouponRoundTrip, NoiseIsCarriedThroughAsStated) {
  constexpr int kSeeds = 40;
  const CouponOptions options;
  const CouponReadings exact = simulated(options, kTrue);
  double values = 0.0;  // Chi square of the values.
  double readings = 0.0;
  int freedom = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const CouponFit fit =
        fit_coupon(testing::with_noise(exact, seed), options.workshop, "readings");
    const auto take = [&](const FittedValue& value, double truth) {
      ASSERT_TRUE(value.determined) << value.key;
      const double off = (value.value - truth) / value.uncertainty;
      EXPECT_LT(std::abs(off), 4.0) << value.key << " seed " << seed;
      values += off * off;
    };
    take(fit.sigma, kTrue.sigma);
    take(fit.diameter, 2.0 * kTrue.radius);
    take(fit.pitch_error, kTrue.pitch_error);
    readings += fit.chi_square;
    freedom += fit.freedom;
  }
  // Within four standard deviations of a chi square, √(2n), of its mean n.
  const auto expect_chi_square = [](double sum, int n) {
    EXPECT_NEAR(sum, n, 4.0 * std::sqrt(2.0 * n));
  };
  expect_chi_square(values, 3 * kSeeds);
  expect_chi_square(readings, freedom);
}

/// Haze of 12 nm over 7 µm in a workshop that says 10 nm over 5 µm, of 15 % noise, by another
/// writing of the model: errors follow the uncertainties that are stated for them.
TEST(CouponRoundTrip, NoiseOfHazeIsCarriedThroughAsStated) {
  constexpr int kSeeds = 40;
  constexpr double kRms = 12.0;
  constexpr double kCorrelation = 7.0;
  CouponOptions options;
  options.workshop.polish.roughness = 10.0;
  CouponReadings exact = expected_readings(coupon_layout(options), options.workshop);
  exact.marks.clear();
  exact.grooves.clear();
  exact.pads.clear();
  const double phase = 1e-6 * kRms * exact.light.phase();
  const double wave = std::numbers::pi * 1e-3 * kCorrelation / exact.light.wavelength;
  for (HazeReadings& haze : exact.haze) {
    const double s = std::sin(std::numbers::pi / 180.0 * haze.place.angle);
    const double ratio = std::expm1(phase * phase) * wave * wave / std::numbers::pi *
                         std::exp(-std::pow(wave * s, 2)) * std::sqrt(1.0 - s * s) *
                         haze.place.solid_angle;
    haze.ratio = Reading{ratio, 0.15 * ratio};
  }
  double roughness = 0.0;  // Chi squares.
  double correlation = 0.0;
  double readings = 0.0;
  int freedom = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const CouponFit fit =
        fit_coupon(testing::with_noise(exact, seed), options.workshop, "readings");
    ASSERT_TRUE(fit.roughness.determined && fit.correlation.determined) << seed;
    roughness += std::pow((fit.roughness.value - kRms) / fit.roughness.uncertainty, 2);
    correlation +=
        std::pow((fit.correlation.value - kCorrelation) / fit.correlation.uncertainty, 2);
    readings += fit.chi_square;
    freedom += fit.freedom;
  }
  const auto expect_chi_square = [](double sum, int n) {
    EXPECT_NEAR(sum, n, 4.0 * std::sqrt(2.0 * n));
  };
  expect_chi_square(roughness, kSeeds);
  expect_chi_square(correlation, kSeeds);
  expect_chi_square(readings, freedom);
  RecordProperty("roughness", std::to_string(roughness / kSeeds));
  RecordProperty("correlation", std::to_string(correlation / kSeeds));
  RecordProperty("readings", std::to_string(readings / freedom));
}

/// How the fits of 40 noisy coupons of one polish judge its order.
struct OrderCount {
  int right = 0;  ///< By three standard errors.
  int wrong = 0;
  double least = 1e9;  ///< Standard errors.
};

OrderCount judged(const CouponReadings& exact, const Workshop& workshop, int order) {
  constexpr std::uint32_t kSeeds = 40;
  OrderCount count;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const CouponFit fit = fit_coupon(testing::with_noise(exact, seed), workshop, "readings");
    if (fit.order.determined) ++(fit.order.value == order ? count.right : count.wrong);
    count.least = std::min(count.least, fit.order_apart);
  }
  return count;
}

/// The workshop's file always says order 2: a film is found against it.
TEST(CouponRoundTrip, ReadingsTellPadsFromAFilm) {
  for (const double sigma : {0.03, 0.036}) {
    for (const int order : {2, 4}) {
      const CouponOptions options;
      TrueWorkshop shop = kTrue;
      shop.sigma = sigma;
      shop.order = order;
      const OrderCount count = judged(simulated(options, shop), options.workshop, order);
      EXPECT_EQ(count.right, 40) << sigma << ' ' << order << ": least " << count.least;
      EXPECT_EQ(count.wrong, 0);
    }
  }
}

TEST(CouponRoundTrip, AFloorIsFoundWithItsOrder) {
  const CouponOptions options;
  for (const int order : {2, 4}) {
    TrueWorkshop shop = kTrue;
    shop.order = order;
    shop.floor = 0.08;
    const CouponReadings exact = simulated(options, shop);
    const CouponFit fit = fit_coupon(exact, options.workshop, "readings");
    EXPECT_EQ(fit.order.value, order);
    EXPECT_TRUE(fit.order.determined) << fit.order_apart;
    ASSERT_TRUE(fit.floor.determined);
    EXPECT_NEAR(fit.floor.value, shop.floor, 0.1 * fit.floor.uncertainty);
    EXPECT_NEAR(fit.sigma.value, shop.sigma, 0.1 * fit.sigma.uncertainty);
    const OrderCount count = judged(exact, options.workshop, order);
    EXPECT_EQ(count.right, 40) << order << ": least " << count.least;
  }
}

TEST(CouponRoundTrip, PassesAlongYAndOneWayAreReadAsWell) {
  CouponOptions options;
  options.workshop.process.finish.along = PassAxis::kY;
  options.workshop.process.finish.style = PassStyle::kClimb;
  const CouponFit fit = fit_coupon(simulated(options, kTrue), options.workshop, "readings");
  EXPECT_NEAR(fit.sigma.value, kTrue.sigma, 0.1 * fit.sigma.uncertainty);
  EXPECT_NEAR(fit.diameter.value, 2.0 * kTrue.radius, 0.1 * fit.diameter.uncertainty);
  EXPECT_NEAR(fit.pitch_error.value, kTrue.pitch_error, 0.1 * fit.pitch_error.uncertainty);
}

/// Of a lens with creases, and pixels so small that what polish rounds shows.
PictureQuality forecast(const Workshop& workshop) {
  Lens lens = testing::small_lens();
  lens.setup.pixels = {60, 40};
  lens.target = Image(60, 40, 1.0F);
  CamOptions options;
  options.workshop = workshop;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.remedies = false;
  const TempFolder folder;
  return make_cut(lens, options, folder.path(), Executor::cpu(2), {}).report.leakage.part().quality;
}

TEST(CouponRoundTrip, TheForecastOfTheFittedWorkshopIsThatOfTheTrueOne) {
  const CouponOptions options;
  const CouponReadings readings = testing::with_noise(simulated(options, kTrue), 7);
  const CouponFit fit = fit_coupon(readings, options.workshop, "readings");
  const PictureQuality believed = forecast(options.workshop);
  const PictureQuality fitted = forecast(fit.applied_to(options.workshop));
  const PictureQuality truth = forecast(true_workshop(options.workshop));
  const double error = std::abs(believed.leakage - truth.leakage);
  EXPECT_GT(error, 0.05 * truth.leakage) << "the coupon would not be worth it";
  EXPECT_LT(std::abs(fitted.leakage - truth.leakage), 0.15 * error);
}

/// The same readings with uncertainties so large that they do not contradict a wrong order.
CouponReadings less_certain(CouponReadings readings) {
  const auto widen = [](std::optional<Reading>& reading) {
    if (reading) reading->uncertainty *= 4.0;
  };
  for (PadReadings& pad : readings.pads) {
    for (auto kind : {&PadReadings::before, &PadReadings::after, &PadReadings::orders}) {
      widen(pad.*kind);
    }
  }
  for (GrooveReadings& groove : readings.grooves) widen(groove.width);
  return readings;
}

/// A fit that is forced to the wrong order predicts 10 to 15 % too much or too little leakage; with
/// the uncertainties of the template it is refused.
TEST(CouponRoundTrip, TheForecastOfTheWrongOrderIsOffByASeventh) {
  const CouponOptions options;
  for (const int order : {2, 4}) {
    TrueWorkshop shop = kTrue;
    shop.order = order;
    const CouponReadings exact = simulated(options, shop);
    EXPECT_THROW(fit_coupon(exact, options.workshop, "readings", 6 - order), InputError);
    const CouponFit fit = fit_coupon(less_certain(exact), options.workshop, "readings", 6 - order);
    const PictureQuality fitted = forecast(fit.applied_to(options.workshop));
    const PictureQuality truth = forecast(true_workshop(options.workshop, shop));
    EXPECT_NEAR(fitted.leakage, truth.leakage, 0.16 * truth.leakage) << order;
  }
}

}  // namespace
}  // namespace lensforge
