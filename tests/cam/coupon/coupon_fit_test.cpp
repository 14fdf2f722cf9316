// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_fit.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "cam/coupon/coupon.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::Not;

/// A workshop that states its roughness.
Workshop rough_workshop(double rms, double correlation) {
  Workshop shop;
  shop.polish.roughness = rms;
  shop.polish.correlation = correlation;
  return shop;
}

/// Haze alone, exact for a polish, where the template of a workshop of 10 nm over 5 µm asks for it.
CouponReadings haze_readings(double rms, double correlation) {
  const CouponReadings asked =
      expected_readings(coupon_layout(CouponOptions{}), rough_workshop(10.0, 5.0));
  CouponReadings readings;
  readings.light = asked.light;
  const CouponState state = CouponState::of(rough_workshop(rms, correlation));
  for (HazeReadings haze : asked.haze) {
    const double ratio = state.haze_ratio(haze.place, readings.light);
    haze.ratio = Reading{ratio, 0.1 * ratio};
    readings.haze.push_back(haze);
  }
  return readings;
}

/// All readings of the default coupon, exact for the default workshop.
CouponReadings sound_readings() {
  return expected_readings(coupon_layout(CouponOptions{}), Workshop{});
}

CouponReadings only_marks() {
  CouponReadings readings = sound_readings();
  readings.grooves.clear();
  readings.pads.clear();
  return readings;
}

CouponFit fit(const CouponReadings& readings) { return fit_coupon(readings, Workshop{}, "m.toml"); }

std::string refusal(const CouponReadings& readings) {
  return message_of<InputError>([&] { fit(readings); });
}

TEST(CouponFit, ReadingsAsExpectedGiveTheWorkshopBack) {
  const CouponFit result = fit(sound_readings());
  EXPECT_NEAR(result.sigma.value, 0.03, 1e-7);
  EXPECT_NEAR(result.diameter.value, 0.4, 1e-7);
  EXPECT_NEAR(result.pitch_error.value, 0.0, 1e-9);
  EXPECT_LT(result.chi_square, 1e-9);
  EXPECT_EQ(result.freedom, sound_readings().count() - 4);
}

TEST(CouponFit, OnlyWhatIsFittedChangesInTheWorkshop) {
  Workshop shop;
  shop.machine.name = "mine";
  shop.process.finish.pitch = 0.05;
  const CouponFit result = fit(only_marks());
  const Workshop fitted = result.applied_to(shop);
  shop.process.finish.pitch_error = result.pitch_error.value;
  EXPECT_EQ(fitted, shop);
}

TEST(CouponFit, TheBallsOtherSizesStay) {
  CouponFit result = fit(sound_readings());
  result.diameter.value = 0.41;
  const Workshop before;
  const Workshop after = result.applied_to(before);
  const int number = before.process.finish.tool;
  Tool expected = before.tool(number);
  expected.diameter = 0.41;
  EXPECT_EQ(after.tool(number), expected);
}

TEST(CouponFit, MarksTellThePitchErrorAlone) {
  CouponReadings readings = only_marks();
  readings.marks[0].distance->value = 40.06;
  const CouponFit result = fit(readings);
  EXPECT_TRUE(result.pitch_error.determined);
  EXPECT_NEAR(result.pitch_error.value, 0.06 / 40.0, 1e-9);
  EXPECT_NEAR(result.pitch_error.uncertainty, 0.03 / 40.0, 1e-9);
  EXPECT_FALSE(result.sigma.determined);
  EXPECT_FALSE(result.diameter.determined);
  EXPECT_EQ(result.sigma.value, Workshop{}.polish.sigma);
}

TEST(CouponFit, ScallopsTellTheRadiusAlone) {
  CouponReadings readings = sound_readings();
  readings.marks.clear();
  readings.grooves.clear();
  for (PadReadings& pad : readings.pads) pad = {pad.pitch, pad.before, {}, {}};
  const CouponFit result = fit(readings);
  EXPECT_TRUE(result.diameter.determined);
  EXPECT_FALSE(result.sigma.determined);
  EXPECT_FALSE(result.pitch_error.determined);
  // Five heights of 5 % each, and the radius goes with their inverse.
  EXPECT_NEAR(result.diameter.uncertainty, 0.4 * 0.05 / std::sqrt(5.0), 0.001);
}

/// One width says nothing of a radius whose touch-off is not known.
TEST(CouponFit, OneGrooveTellsNothing) {
  CouponReadings readings = sound_readings();
  readings.marks.clear();
  readings.pads.clear();
  readings.grooves.resize(1);
  const CouponFit result = fit(readings);
  EXPECT_FALSE(result.diameter.determined);
  EXPECT_FALSE(result.sigma.determined);
}

/// A ripple goes with 1/R and with σ: with one alone, the radius is the workshop's.
TEST(CouponFit, OneRippleTellsSigmaForTheWorkshopsBall) {
  CouponReadings readings = sound_readings();
  readings.marks.clear();
  readings.grooves.clear();
  readings.pads = {{readings.pads[2].pitch, {}, readings.pads[2].after, {}}};
  const CouponFit result = fit(readings);
  EXPECT_TRUE(result.sigma.determined);
  EXPECT_NEAR(result.sigma.value, 0.03, 1e-7);
  EXPECT_FALSE(result.diameter.determined);
}

TEST(CouponFit, LightAloneTellsSigma) {
  CouponReadings readings = sound_readings();
  readings.marks.clear();
  readings.grooves.clear();
  for (PadReadings& pad : readings.pads) pad = {pad.pitch, {}, {}, pad.orders};
  const CouponFit result = fit(readings);
  EXPECT_TRUE(result.sigma.determined);
  EXPECT_NEAR(result.sigma.value, 0.03, 1e-6);
  EXPECT_LT(result.sigma.uncertainty, 0.001);
}

TEST(CouponFit, SigmaIsFoundFromFarOff) {
  Workshop truth;
  const CouponLayout layout = coupon_layout(CouponOptions{});
  for (const double sigma : {0.012, 0.02, 0.045, 0.06}) {
    truth.polish.sigma = sigma;
    const CouponFit result = fit(expected_readings(layout, truth));
    EXPECT_TRUE(result.sigma.determined) << sigma;
    EXPECT_NEAR(result.sigma.value, sigma, 1e-5 * sigma);
  }
}

/// The sheet promises it for half of the shallowest groove.
TEST(CouponFit, ATouchOffThatIsWrongDoesNoHarm) {
  for (const double offset : {-0.015, 0.015}) {
    CouponReadings readings = sound_readings();
    readings.marks.clear();
    readings.pads.clear();
    for (GrooveReadings& groove : readings.grooves) {
      groove.width->value = groove_width(0.205, groove.depth + offset);
    }
    const CouponFit result = fit(readings);
    EXPECT_NEAR(result.diameter.value, 0.41, 1e-4);
    EXPECT_NEAR(result.touch_off.value, offset, 1e-4);
  }
}

TEST(CouponFit, UncertaintiesGoWithThoseOfTheReadings) {
  CouponReadings readings = only_marks();
  const double before = fit(readings).pitch_error.uncertainty;
  readings.marks[0].distance->uncertainty *= 0.5;
  EXPECT_NEAR(fit(readings).pitch_error.uncertainty, 0.5 * before, 1e-12);
  readings.marks.push_back(readings.marks[0]);
  EXPECT_NEAR(fit(readings).pitch_error.uncertainty, 0.5 * before / std::sqrt(2.0), 1e-12);
}

TEST(CouponFit, WhatIsTooUncertainIsNotDetermined) {
  CouponReadings readings = only_marks();
  readings.marks[0].distance->uncertainty = 0.5;
  const CouponFit result = fit(readings);
  EXPECT_FALSE(result.pitch_error.determined);
  EXPECT_EQ(result.pitch_error.value, 0.0);
}

TEST(CouponFit, TheReadingThatContradictsTheOthersIsNamed) {
  for (std::size_t i = 0; i < 5; ++i) {
    CouponReadings readings = sound_readings();
    readings.grooves[i].width->value += 0.03;
    EXPECT_THAT(refusal(readings), AllOf(HasSubstr("m.toml: groove[" + std::to_string(i) + "]"),
                                         HasSubstr("standard deviations"), Not(HasSubstr("pad"))));
  }
  CouponReadings readings = sound_readings();
  readings.pads[4].after->value *= 1.6;
  EXPECT_THAT(refusal(readings), HasSubstr("pad[4].after_um (P5): "));
}

TEST(CouponFit, TwoThatContradictOneAnotherAreBothNamed) {
  CouponReadings readings = only_marks();
  readings.marks.push_back(readings.marks[0]);
  readings.marks[1].distance->value += 0.3;
  EXPECT_THAT(refusal(readings), AllOf(HasSubstr("is 7.1 standard deviations"),
                                       HasSubstr("mark[0]"), HasSubstr("mark[1]")));
}

TEST(CouponFit, AReadingOfAnotherUnitIsRefused) {
  CouponReadings readings = sound_readings();
  readings.grooves[1].width->value *= 1000.0;
  EXPECT_THAT(refusal(readings), HasSubstr("groove[1].width_mm (G2): 210.7"));
  readings = sound_readings();
  readings.pads[0].before->value /= 1000.0;
  EXPECT_THAT(refusal(readings), HasSubstr("pad[0].before_um (P1): 0.0035"));
  readings = sound_readings();
  readings.pads[0].after->value = 0.02;
  EXPECT_THAT(refusal(readings),
              AllOf(HasSubstr("pad[0].after_um (P1): 20"), HasSubstr("before polishing")));
  readings = only_marks();
  readings.marks[0].distance->value = 4.0;
  EXPECT_THAT(refusal(readings), HasSubstr("mark[0].distance_mm: 4"));
}

TEST(CouponFit, HazeAloneTellsRoughnessAndCorrelation) {
  for (const double rms : {2.0, 12.0, 40.0}) {
    for (const double correlation : {3.0, 5.0, 7.0, 9.0}) {
      const CouponFit result = fit(haze_readings(rms, correlation));
      EXPECT_TRUE(result.haze);
      ASSERT_TRUE(result.roughness.determined) << rms << ' ' << correlation;
      EXPECT_NEAR(result.roughness.value, rms, 1e-4 * rms);
      EXPECT_FALSE(result.sigma.determined);
      EXPECT_FALSE(result.diameter.determined);
      ASSERT_TRUE(result.correlation.determined) << rms << ' ' << correlation;
      EXPECT_NEAR(result.correlation.value, correlation, 1e-4 * correlation);
      const Workshop fitted = result.applied_to({});
      EXPECT_EQ(fitted, rough_workshop(result.roughness.value, result.correlation.value));
    }
  }
}

/// Four readings r of 10 % each, where ln r = 2 ln σ_r + 2 ln ℓ − (π ℓ s / λ)² + a constant.
TEST(CouponFit, UncertaintiesOfHazeAreThoseOfALine) {
  const CouponReadings readings = haze_readings(5.0, 5.0);
  const CouponFit result = fit(readings);
  Eigen::MatrixXd lines(4, 2);
  for (int i = 0; i < 4; ++i) {
    const double s = readings.haze[static_cast<std::size_t>(i)].place.sine();
    const double wave = std::numbers::pi * 5e-3 * s / readings.light.wavelength;
    lines.row(i) << 2.0, 2.0 - 2.0 * wave * wave;
  }
  const Eigen::MatrixXd inverse = (lines.transpose() * lines).inverse();
  const double rms = 5.0 * 0.1 * std::sqrt(inverse(0, 0));
  const double correlation = 5.0 * 0.1 * std::sqrt(inverse(1, 1));
  EXPECT_NEAR(result.roughness.uncertainty, rms, 2e-3 * rms);
  EXPECT_NEAR(result.correlation.uncertainty, correlation, 1e-4 * correlation);
}

/// One angle does not tell how wide the haze is: the roughness is fitted for the workshop's own
/// width, and an error of a quarter of that is in its uncertainty.
TEST(CouponFit, OneAngleTellsTheRoughnessForTheWorkshopsCorrelation) {
  CouponReadings readings = haze_readings(12.0, 5.0);
  readings.haze.resize(1);
  const CouponFit result = fit(readings);
  ASSERT_TRUE(result.roughness.determined);
  EXPECT_NEAR(result.roughness.value, 12.0, 1e-3);
  EXPECT_FALSE(result.correlation.determined);
  EXPECT_EQ(result.correlation.value, 5.0);
  const double s = readings.haze[0].place.sine();
  const double wave = std::numbers::pi * 5e-3 * s / readings.light.wavelength;
  const double held = 0.25 * (1.0 - wave * wave);  // d ln σ_r / d ln ℓ is x − 1.
  EXPECT_NEAR(result.roughness.uncertainty, 12.0 * std::hypot(0.05, held), 0.02);
  // The same angle twice tells no more.
  readings.haze.push_back(readings.haze[0]);
  EXPECT_FALSE(fit(readings).correlation.determined);
}

TEST(CouponFit, HazeThatIsTooUncertainIsNotDetermined) {
  CouponReadings readings = haze_readings(12.0, 5.0);
  for (HazeReadings& haze : readings.haze) haze.ratio->uncertainty *= 30.0;
  const CouponFit result = fit(readings);
  EXPECT_TRUE(result.haze);
  EXPECT_FALSE(result.roughness.determined);
  EXPECT_FALSE(result.correlation.determined);
  EXPECT_EQ(result.applied_to({}), Workshop{});
}

TEST(CouponFit, HazeAndTheOtherReadingsDoNotTouchOneAnother) {
  CouponReadings readings = sound_readings();
  const CouponFit without = fit(readings);
  EXPECT_FALSE(without.haze);
  EXPECT_EQ(without.values().size(), 5U);
  const CouponReadings haze = haze_readings(12.0, 7.0);
  readings.haze = haze.haze;
  const CouponFit both = fit(readings);
  const CouponFit alone = fit(haze);
  EXPECT_EQ(both.values().size(), 7U);
  const auto expect_same = [](const FittedValue& a, const FittedValue& b) {
    EXPECT_NEAR(a.value, b.value, 1e-6 * b.uncertainty) << a.key;
    EXPECT_NEAR(a.uncertainty, b.uncertainty, 1e-5 * b.uncertainty) << a.key;
  };
  expect_same(both.sigma, without.sigma);
  expect_same(both.diameter, without.diameter);
  expect_same(both.pitch_error, without.pitch_error);
  expect_same(both.roughness, alone.roughness);
  expect_same(both.correlation, alone.correlation);
}

TEST(CouponFit, HazeThatContradictsTheOthersIsNamed) {
  CouponReadings readings = haze_readings(12.0, 5.0);
  readings.haze[1].ratio->value *= 3.0;
  EXPECT_THAT(refusal(readings), AllOf(HasSubstr("m.toml: haze[1].light_ratio (F): "),
                                       HasSubstr("standard deviations")));
}

TEST(CouponFit, NoReadingsAreRefused) {
  EXPECT_THAT(refusal(CouponReadings{}), HasSubstr("m.toml: 0 readings"));
}

}  // namespace
}  // namespace lensforge
