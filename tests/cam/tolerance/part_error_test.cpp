// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

constexpr int kParts = 4000;

ErrorSource source() {
  ErrorSource source;
  source.lens_size = {20.0, 10.0};
  source.seed = 5;
  return source;
}

/// Mean and standard deviation of something over many parts.
template <class Value>
std::pair<double, double> spread(const ErrorSource& source, const Value& value) {
  double sum = 0.0;
  double squares = 0.0;
  for (int part = 0; part < kParts; ++part) {
    const double v = value(source.draw(static_cast<std::uint64_t>(part), whole_errors()));
    sum += v;
    squares += v * v;
  }
  const double mean = sum / kParts;
  return {mean, std::sqrt(squares / kParts - mean * mean)};
}

TEST(RandomDraw, IsEvenAndNormal) {
  RandomDraw random(1, 2, 3);
  double sum = 0.0;
  double squares = 0.0;
  double fourth = 0.0;
  double shares = 0.0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double normal = random.normal();
    sum += normal;
    squares += normal * normal;
    fourth += normal * normal * normal * normal;
    shares += random.share();
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.01);
  EXPECT_NEAR(squares / kCount, 1.0, 0.02);
  EXPECT_NEAR(fourth / kCount, 3.0, 0.1);
  EXPECT_NEAR(shares / kCount, 0.5, 0.005);
}

TEST(RandomDraw, DependsOnSeedPartAndCauseAlone) {
  EXPECT_EQ(RandomDraw(1, 2, 3).share(), RandomDraw(1, 2, 3).share());
  EXPECT_NE(RandomDraw(1, 2, 3).share(), RandomDraw(2, 2, 3).share());
  EXPECT_NE(RandomDraw(1, 2, 3).share(), RandomDraw(1, 3, 3).share());
  EXPECT_NE(RandomDraw(1, 2, 3).share(), RandomDraw(1, 2, 4).share());
}

TEST(ErrorSource, DrawsWhatTheTolerancesState) {
  const ErrorSource from = source();
  const Tolerances& t = from.tolerances;
  const double root3 = std::sqrt(3.0);
  const auto near = [](double value, double expected) {
    EXPECT_NEAR(value, expected, 0.05 * expected);
  };
  near(spread(from, [](const PartError& e) { return e.sigma_factor; }).second, t.polish_sigma);
  near(spread(from, [](const PartError& e) { return e.tilt.y(); }).second,
       t.tilt_deg * std::numbers::pi / 180.0);
  near(spread(from, [](const PartError& e) { return e.distance; }).second, t.distance / root3);
  near(spread(from, [](const PartError& e) { return e.radius; }).second,
       1e-3 * t.radius_um / root3);
  near(spread(from, [](const PartError& e) { return e.backlash; }).first, 0.5e-3 * t.backlash_um);
  near(spread(from, [](const PartError& e) { return e.eccentricity; }).first,
       0.25e-3 * t.runout_um);
  near(spread(from, [](const PartError& e) { return e.source; }).first, 0.5e-3 * t.source_mrad);
  near(spread(from, [](const PartError& e) { return e.rows.height[3]; }).second, 1e-3 * t.row_um);
  near(spread(from, [](const PartError& e) { return e.expansion; }).second,
       t.expansion_per_k * t.temperature_k / root3);
  near(spread(from, [](const PartError& e) { return e.index; }).second,
       std::hypot(t.index, t.index_per_k * t.temperature_k) / root3);
  const auto wave_at = [](const PartError& e) {
    double z = 0.0;
    for (const Wave& wave : e.along_y) z += wave.amplitude * std::cos(wave.wave * 3.3 + wave.phase);
    return z;
  };
  double rms = 0.0;
  for (const WavinessBand& band : t.waviness) rms = std::hypot(rms, 1e-3 * band.rms_um);
  near(spread(from, wave_at).second, rms);
}

TEST(ErrorSource, HalvesOneCauseAndLeavesAllElse) {
  const ErrorSource from = source();
  const PartError whole = from.draw(7, whole_errors());
  const PartError half = from.draw(7, with_scale(ErrorCause::kTemperature, 0.5));
  EXPECT_DOUBLE_EQ(half.expansion, 0.5 * whole.expansion);
  EXPECT_EQ(half.rows.height, whole.rows.height);
  EXPECT_EQ(half.tilt, whole.tilt);
  EXPECT_EQ(half.source, whole.source);
  const PartError polish = from.draw(7, with_scale(ErrorCause::kPolish, 0.5));
  EXPECT_DOUBLE_EQ(polish.sigma_factor - 1.0, 0.5 * (whole.sigma_factor - 1.0));
  EXPECT_EQ(polish.sigma_within, 0.5 * whole.sigma_within);
}

TEST(ErrorSource, EveryCauseCounts) {
  const ErrorSource from = source();
  for (const ErrorCause cause : error_causes()) {
    const PartError none = from.draw(3, with_scale(cause, 0.0));
    const PartError whole = from.draw(3, whole_errors());
    const auto figures = [](const PartError& e) {
      return std::vector<double>{e.along_x[0].amplitude,
                                 e.rows.places > 0 ? e.rows.height[0] : 0.0,
                                 e.backlash,
                                 e.radius,
                                 e.sigma_factor,
                                 e.index,
                                 e.distance,
                                 e.tilt.x(),
                                 e.source,
                                 e.expansion};
    };
    const auto k = static_cast<std::size_t>(cause);
    for (std::size_t i = 0; i < kErrorCauses; ++i) {
      const bool also_by_temperature = cause == ErrorCause::kTemperature && i == 5;
      if (also_by_temperature) continue;
      EXPECT_EQ(figures(none)[i] != figures(whole)[i], i == k) << name_of(cause) << " " << i;
    }
  }
}

}  // namespace
}  // namespace lensforge
