// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/tolerance_forecast.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <stop_token>

#include "cam/tolerance/part_error.h"
#include "cam/tolerance/part_model.h"
#include "core/error.h"
#include "core/lens/surface_field.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;

/// A bowl that lights a smaller picture than the lens, with its ridges as cut.
class Bowl final : public SurfaceField {
 public:
  void sample(const GridWindow& window, const Executor& /*executor*/,
              SurfacePatch& patch) const override {
    resize_patch(window, false, patch);
    for (std::int64_t j = 0; j < window.rows; ++j) {
      for (std::int64_t i = 0; i < window.columns; ++i) {
        const Eigen::Vector2d at = window.node(i, j) - Eigen::Vector2d(1.5, 1.5);
        const auto n = static_cast<std::size_t>(j * window.columns + i);
        patch.z[n] = 2.0 - 0.02 * at.squaredNorm();
        patch.slope_x[n] = -0.04 * at.x();
        patch.slope_y[n] = -0.04 * at.y();
      }
    }
  }
};

/// A lens whose target is its own picture, next to a black margin.
class Toy {
 public:
  Toy() {
    plan_.optics.lens_size = {3.0, 3.0};
    plan_.optics.image_size = {3.0, 3.0};
    plan_.optics.pixels = {12, 12};
    plan_.optics.focal_length = 14.0;
    plan_.polish.sigma = 0.03;
    plan_.largest_sigma = 0.04;
    plan_.apron = 0.5;
    const FieldRenderSetup fine{plan_.optics, lens_grid(plan_.optics.lens_size, 0.02)};
    designed_ = render_field(bowl_, fine, executor_, {});
    target_ = designed_.image(144.0);
    judge_.emplace(target_, designed_, LeakageOptions{});
    model_.emplace(bowl_, plan_, executor_, RunControl());
    source_.lens_size = plan_.optics.lens_size;
    source_.passes = plan_.passes;
    source_.seed = 3;
    source_.tolerances.tilt_deg = 0.05;
    source_.tolerances.distance = 0.6;
  }

  [[nodiscard]] ToleranceForecast forecast(std::int64_t parts,
                                           const Executor& executor = Executor::cpu(2),
                                           const RunControl& control = {}) const {
    return forecast_parts(*model_, source_, *judge_, ranking_draws(parts), executor, control);
  }
  ErrorSource& source() { return source_; }

 private:
  Bowl bowl_;
  Executor executor_ = Executor::cpu(2);
  PartPlan plan_;
  FluxPicture designed_;
  Image target_;
  std::optional<PictureJudge> judge_;
  std::optional<PartModel> model_;
  ErrorSource source_;
};

const CauseEffect& effect_of(const ToleranceForecast& forecast, ErrorCause cause) {
  for (const CauseEffect& effect : forecast.causes) {
    if (effect.cause == cause) return effect;
  }
  return forecast.causes.front();
}

TEST(ToleranceForecast, WithoutTolerancesEveryPartIsTheNominalOne) {
  Toy toy;
  Tolerances none;
  none.waviness = {{10.0, 0.0}};
  none.row_um = none.backlash_um = none.radius_um = none.runout_um = 0.0;
  none.polish_sigma = none.polish_within = none.index = none.distance = 0.0;
  none.tilt_deg = none.source_mrad = none.temperature_k = 0.0;
  toy.source().tolerances = none;
  const ToleranceForecast forecast = toy.forecast(10);
  EXPECT_EQ(forecast.mae.p10, forecast.nominal.mae);
  EXPECT_EQ(forecast.mae.p90, forecast.nominal.mae);
  for (const double deviation : forecast.deviation) EXPECT_EQ(deviation, 0.0);
  for (const CauseEffect& effect : forecast.causes) EXPECT_EQ(effect.mae, 0.0);
  EXPECT_THAT(tolerance_words(forecast), HasSubstr("No single cause"));
}

TEST(ToleranceForecast, HalvingACauseBringsWhatARunWithHalfOfItShows) {
  Toy toy;
  const std::int64_t parts = 100;
  const ToleranceForecast whole = toy.forecast(parts);
  const CauseEffect predicted = effect_of(whole, ErrorCause::kDistance);
  EXPECT_EQ(whole.causes.front().cause, ErrorCause::kDistance);
  toy.source().tolerances.distance *= 0.5;
  const ToleranceForecast half = toy.forecast(parts);
  EXPECT_LT(predicted.mae, -1e-3);
  EXPECT_NEAR(half.mae.median - whole.mae.median, predicted.mae,
              std::max(0.35 * std::abs(predicted.mae), 3.0 * predicted.mae_error));
}

TEST(ToleranceForecast, GivesTheSameBitsForAnyNumberOfThreads) {
  const Toy toy;
  const ToleranceForecast one = toy.forecast(10, Executor::serial());
  const ToleranceForecast three = toy.forecast(10, Executor::cpu(3));
  EXPECT_EQ(one.mae.median, three.mae.median);
  EXPECT_EQ(one.deviation, three.deviation);
  EXPECT_EQ(one.causes.front().mae, three.causes.front().mae);
}

TEST(ToleranceForecast, AnotherSeedDrawsOtherParts) {
  Toy toy;
  const ToleranceForecast one = toy.forecast(10);
  toy.source().seed = 4;
  EXPECT_NE(one.mae.median, toy.forecast(10).mae.median);
}

TEST(ToleranceForecast, ReportsItsPartsAndStopsBetweenThem) {
  const Toy toy;
  std::stop_source stop;
  double total = 0.0;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    total = progress.total;
    if (progress.done >= 3.0) stop.request_stop();
  });
  EXPECT_THROW((void)toy.forecast(20, Executor::cpu(2), control), Interrupted);
  EXPECT_EQ(total, 1.0 + 20.0 + 5.0 * kErrorCauses);
}

TEST(Quantiles, AreLinearBetweenSortedValues) {
  const Quantiles q = quantiles({5.0, 1.0, 3.0, 2.0, 4.0});
  EXPECT_DOUBLE_EQ(q.p10, 1.4);
  EXPECT_DOUBLE_EQ(q.median, 3.0);
  EXPECT_DOUBLE_EQ(q.p90, 4.6);
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(quantiles({infinite, infinite}).median, infinite);
}

TEST(PictureSpread, IsTheStandardDeviationOfEncodedValues) {
  PictureSpread spread;
  for (const float value : {0.0F, 1.0F}) spread.add(Image(2, 1, value));
  const std::vector<double> deviation = spread.deviation();
  EXPECT_NEAR(deviation[0], std::sqrt(0.5), 1e-12);
}

TEST(ToleranceWords, SayWhatToExpectAndWhatMatters) {
  ToleranceForecast forecast;
  forecast.parts = 200;
  forecast.has_dark = true;
  forecast.contrast = {20.2, 26.0, 34.8};
  forecast.mae = {0.0102, 0.0121, 0.0151};
  forecast.causes = {{ErrorCause::kPolish, -0.0012, 1e-4, -0.001, -0.005}};
  EXPECT_EQ(
      tolerance_words(forecast),
      "8 of 10 parts should have a contrast of 20 : 1 to 35 : 1 and an MAE of 0.0102 to 0.0151. "
      "What matters most is the strength of the polish: with half its error the MAE would be "
      "0.0012 "
      "lower and the median contrast 30 : 1 instead of 26 : 1.");
}

}  // namespace
}  // namespace lensforge
