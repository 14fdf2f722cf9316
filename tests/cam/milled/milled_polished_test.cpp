// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "cam/analytic_fields.h"
#include "cam/milled/polished_field.h"
#include "cam/milled_paths.h"
#include "cam/milled_tiles.h"
#include "core/error.h"

namespace lensforge::milled_polished_test {
namespace {

const Eigen::AlignedBox2d kLens(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(2.0, 1.5));

/// A surface of known heights and slopes.
class Formula final : public SurfaceField {
 public:
  using Function = std::function<Eigen::Vector3d(double, double)>;  ///< z, ∂z/∂x, ∂z/∂y
  explicit Formula(Function function) : function_(std::move(function)) {}

  void sample(const GridWindow& window, const Executor& /*executor*/,
              SurfacePatch& patch) const override {
    resize_patch(window, true, patch);
    for (std::int64_t n = 0; n < window.size(); ++n) {
      const Eigen::Vector2d q = window.node(n % window.columns, n / window.columns);
      const Eigen::Vector3d at = function_(q.x(), q.y());
      const auto i = static_cast<std::size_t>(n);
      patch.z[i] = at[0];
      patch.slope_x[i] = at[1];
      patch.slope_y[i] = at[2];
      patch.cut[i] = 7;
    }
  }

 private:
  Function function_;
};

Eigen::Vector3d plane(double x, double y) { return {5.0 + 0.3 * x - 0.2 * y, 0.3, -0.2}; }

GridWindow whole_lens() { return testing::window_at({0.0, 0.0}, 0.01, 201, 151); }

TEST(PolishedField, APlaneStaysAPlaneToTheRim) {
  const Formula surface(plane);
  const SurfacePatch patch =
      testing::sampled(PolishedField(surface, kLens, {0.03, 0.0, 1.0}), whole_lens());
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 201, n / 201);
    const auto i = static_cast<std::size_t>(n);
    EXPECT_NEAR(patch.z[i], plane(q.x(), q.y())[0], 1e-13);
    EXPECT_NEAR(patch.slope_x[i], 0.3, 1e-12);
    EXPECT_NEAR(patch.slope_y[i], -0.2, 1e-12);
  }
  EXPECT_TRUE(patch.cut.empty());
}

/// Largest error of a plane's slope across the rows of a ball that go on beyond it, whose marks
/// begin somewhere in a pass.
double marks_tilt(double phase) {
  constexpr double kPitch = 0.045;
  const Formula cut([&](double x, double y) {
    const double row = y / kPitch + phase;
    const double offset = kPitch * (row - std::round(row));
    const Eigen::Vector3d on = plane(x, y);
    return Eigen::Vector3d(on[0] + offset * offset / 0.4, on[1], on[2] + offset / 0.2);
  });
  const PolishedField part(cut, kLens, {0.03, 0.0, 1.0});
  double worst = 0.0;
  for (const double slope : testing::sampled(part, whole_lens()).slope_y) {
    worst = std::max(worst, std::abs(slope + 0.2));
  }
  return worst;
}

/// Of the marks' slopes, up to 0.11, polish leaves 1e-5, and the nodes, four and a half a pass,
/// alias to the rest. Where marks were mirrored at the rim they tilted it by up to 0.0025.
TEST(PolishedField, MarksOnAPlaneDoNotTiltItAtTheRim) {
  for (const double phase : {0.0, 0.3, 0.5}) EXPECT_LT(marks_tilt(phase), 6e-4) << phase;
}

TEST(PolishedField, AWaveFadesAsTheGaussiansTransferFunctionSays) {
  const double k = 2.0 * std::numbers::pi / 0.2;
  const double l = 2.0 * std::numbers::pi / 0.5;
  const Formula surface([&](double x, double y) {
    return Eigen::Vector3d(std::sin(k * x + l * y), k * std::cos(k * x + l * y),
                           l * std::cos(k * x + l * y));
  });
  const double sigma = 0.03;
  const SurfacePatch patch = testing::sampled(PolishedField(surface, kLens, {sigma, 0.0, 1.0}),
                                              testing::window_at({0.5, 0.4}, 0.01, 60, 50));
  const double fade = std::exp(-0.5 * sigma * sigma * (k * k + l * l));
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 60, n / 60);
    const double phase = k * q.x() + l * q.y();
    const auto i = static_cast<std::size_t>(n);
    EXPECT_NEAR(patch.z[i], fade * std::sin(phase), 2e-6);
    EXPECT_NEAR(patch.slope_x[i], fade * k * std::cos(phase), 1e-5 * k);
    EXPECT_NEAR(patch.slope_y[i], fade * l * std::cos(phase), 1e-5 * l);
  }
}

/// Largest errors of a wave of height 1, as shares of the wave's heights and slopes.
struct WaveError {
  double height = 0.0;
  double slope = 0.0;
};

WaveError wave_error(const PolishModel& model, const Eigen::Vector2d& k,
                     const Eigen::Vector2d& spacing) {
  const Formula surface([&](double x, double y) {
    const double phase = k.x() * x + k.y() * y;
    return Eigen::Vector3d(std::sin(phase), k.x() * std::cos(phase), k.y() * std::cos(phase));
  });
  GridWindow window = testing::window_at({0.5, 0.4}, 1.0, 23, 19);
  window.spacing = spacing;
  const SurfacePatch patch = testing::sampled(PolishedField(surface, kLens, model), window);
  const double t = std::pow(model.sigma * k.norm() / std::numbers::sqrt2, model.order);
  const double left = model.floor + (1.0 - model.floor) * std::exp(-t);
  WaveError error;
  for (std::int64_t n = 0; n < window.size(); ++n) {
    const Eigen::Vector2d q = window.node(n % window.columns, n / window.columns);
    const auto i = static_cast<std::size_t>(n);
    const double phase = k.dot(q);
    const Eigen::Vector2d slope = left * std::cos(phase) * k;
    error.height = std::max(error.height, std::abs(patch.z[i] - left * std::sin(phase)));
    error.slope =
        std::max(error.slope,
                 std::hypot(patch.slope_x[i] - slope.x(), patch.slope_y[i] - slope.y()) / k.norm());
  }
  return error;
}

/// Wave numbers from 5 % of 1/σ to where nothing is left, in five directions; nodes a fifth of σ
/// apart, as many across as a lens's, and σ apart along the rows.
TEST(PolishedField, AFilmLevelsWavesOfAllDirectionsByTheFourthPowerOfTheirWaveNumber) {
  const PolishModel film{0.03, 0.0, 1.0, 4};
  for (const Eigen::Vector2d& spacing : {Eigen::Vector2d(0.006, 0.006), {0.03, 0.01}}) {
    for (const double in_sigma : {0.05, 0.3, 0.6, 1.0, 1.3, 1.7, 2.1, 2.6}) {
      for (const double turn : {0.0, 0.3, 0.25 * std::numbers::pi, 1.2, 0.5 * std::numbers::pi}) {
        const Eigen::Vector2d k = in_sigma / 0.03 * Eigen::Vector2d(std::cos(turn), std::sin(turn));
        const WaveError error = wave_error(film, k, spacing);
        EXPECT_LT(error.height, 1e-4) << in_sigma << ' ' << turn;
        EXPECT_LT(error.slope, 1e-4) << in_sigma << ' ' << turn;
      }
    }
  }
}

TEST(PolishedField, AFloorKeepsItsShareOfEveryWave) {
  for (const int order : {2, 4}) {
    const PolishModel pads{0.03, 0.0, 1.0, order, 0.1};
    for (const double in_sigma : {0.1, 1.0, 2.0, 3.0, 4.0}) {
      const Eigen::Vector2d k = in_sigma / 0.03 * Eigen::Vector2d(0.6, 0.8);
      const WaveError error = wave_error(pads, k, {0.006, 0.006});
      EXPECT_LT(error.height, 1e-4) << order << ' ' << in_sigma;
      EXPECT_LT(error.slope, 1e-4) << order << ' ' << in_sigma;
    }
  }
}

TEST(PolishedField, AFilmLeavesAPlaneAPlane) {
  const Formula surface(plane);
  for (const double floor : {0.0, 0.2}) {
    const SurfacePatch patch =
        testing::sampled(PolishedField(surface, kLens, {0.03, 0.0, 1.0, 4, floor}), whole_lens());
    for (std::int64_t n = 0; n < patch.window.size(); ++n) {
      const Eigen::Vector2d q = patch.window.node(n % 201, n / 201);
      const auto i = static_cast<std::size_t>(n);
      ASSERT_NEAR(patch.z[i], plane(q.x(), q.y())[0], 1e-12);
      ASSERT_NEAR(patch.slope_x[i], 0.3, 1e-11);
      ASSERT_NEAR(patch.slope_y[i], -0.2, 1e-11);
    }
  }
}

TEST(PolishedField, AScallopsEdgeFadesToTheClosedForm) {
  // A roof |x − 1|: heights become σ√(2/π) on the ridge, slopes erf((x − 1)/(σ√2)).
  const Formula surface([](double x, double) {
    return Eigen::Vector3d(std::abs(x - 1.0), x < 1.0 ? -1.0 : x > 1.0 ? 1.0 : 0.0, 0.0);
  });
  const double sigma = 0.05;
  const GridWindow window = testing::window_at({0.0, 0.0}, 0.005, 401, 3);
  const SurfacePatch patch =
      testing::sampled(PolishedField(surface, kLens, {sigma, 0.0, 1.0}), window);
  EXPECT_NEAR(patch.z[200], sigma * std::sqrt(2.0 / std::numbers::pi), 1e-4);
  for (std::size_t i = 0; i < 401; ++i) {
    const double x = window.x(static_cast<std::int64_t>(i));
    EXPECT_NEAR(patch.slope_x[i], std::erf((x - 1.0) / (sigma * std::sqrt(2.0))), 1e-3);
  }
}

/// The floor's share of them is there, but its mean over a few passes is nothing: with the
/// surface's own slopes it was up to 1.5 mrad.
TEST(PolishedField, ScallopsThatAFloorLeavesDoNotComeBackAsWaves) {
  const double pitch = 0.0598802;
  const Formula scallops([&](double, double y) {
    const double offset = y - pitch * std::round(y / pitch);
    return Eigen::Vector3d(offset * offset / 0.4, 0.0, offset / 0.2);
  });
  const PolishedField part(scallops, kLens, {0.03, 0.0, 1.0, 2, 0.1});
  const SurfacePatch patch = testing::sampled(part, testing::window_at({0.2, 0.05}, 0.01, 1, 141));
  for (std::size_t from = 0; from + 24 <= patch.slope_y.size(); from += 6) {
    double sum = 0.0;
    double largest = 0.0;
    for (std::size_t i = from; i < from + 24; ++i) {
      sum += patch.slope_y[i];
      largest = std::max(largest, std::abs(patch.slope_y[i]));
    }
    EXPECT_NEAR(sum / 24.0, 0.0, 2e-4) << from;
    EXPECT_GT(largest, 5e-3);
  }
}

TEST(PolishedField, ScallopsSampledAFewTimesEachDoNotComeBackAsWaves) {
  // Six nodes a pass, and a little less: the slopes' sixth harmonic would beat every 5 mm.
  const double pitch = 0.0598802;
  const Formula scallops([&](double, double y) {
    const double offset = y - pitch * std::round(y / pitch);
    return Eigen::Vector3d(offset * offset / 0.4, 0.0, offset / 0.2);
  });
  const SurfacePatch patch = testing::sampled(PolishedField(scallops, kLens, {0.03, 0.0, 1.0}),
                                              testing::window_at({0.2, 0.2}, 0.01, 3, 110));
  // What the Gaussian leaves of the first harmonic: 0.3 rad / π · exp(−2 (π σ / p)²) = 7e-4.
  for (const double slope : patch.slope_y) EXPECT_NEAR(slope, 0.0, 8e-4);
}

/// Slopes of z = −s·|(p − q)·n| averaged with the Gaussian, across the ridge.
double ridge_slope(double slope, double sigma, double distance) {
  return -slope * std::erf(distance / (sigma * std::numbers::sqrt2));
}

/// Nodes a third of σ apart: without the correction slopes are off by up to 7e-4.
TEST(PolishedField, ARidgeCountsWhereItRunsBetweenNodes) {
  constexpr double kSlope = 0.15;
  constexpr double kSigma = 0.03;
  for (const double turn : {0.0, 0.03, 0.4, 0.25 * std::numbers::pi, 1.2, 0.5 * std::numbers::pi}) {
    const Eigen::Vector2d across(std::cos(turn), std::sin(turn));
    for (const double shift : {0.0, 0.0013, 0.0049, 0.0071}) {
      const Eigen::Vector2d on(1.0 + shift, 0.7 + shift);
      const testing::AnalyticField roof([&](const Eigen::Vector2d& p) {
        const double distance = (p - on).dot(across);
        const double side = distance < 0.0 ? 1.0 : -1.0;
        return testing::SurfacePoint{5.0 - kSlope * std::abs(distance), side * kSlope * across,
                                     side < 0.0 ? 1 : 2};
      });
      const SurfacePatch patch = testing::sampled(PolishedField(roof, kLens, {kSigma, 0.0, 1.0}),
                                                  testing::window_at({0.9, 0.6}, 0.01, 21, 21));
      for (std::int64_t n = 0; n < patch.window.size(); ++n) {
        const auto i = static_cast<std::size_t>(n);
        const double distance = (patch.window.node(n % 21, n / 21) - on).dot(across);
        const Eigen::Vector2d slope = ridge_slope(kSlope, kSigma, distance) * across;
        ASSERT_NEAR(patch.slope_x[i], slope.x(), 1e-4) << turn << ' ' << shift;
        ASSERT_NEAR(patch.slope_y[i], slope.y(), 1e-4) << turn << ' ' << shift;
      }
    }
  }
}

/// What a ball leaves of a surface that bends as a lens does: its crests wander over the nodes.
TEST(PolishedField, CrestsThatWanderOverTheNodesMakeNoWave) {
  constexpr double kRadius = 0.2;
  constexpr double kPitch = 0.0444;
  const auto row_height = [&](double row) { return 0.02 * std::sin(2.7 * row * kPitch); };
  const testing::AnalyticField scallops([&](const Eigen::Vector2d& p) {
    const double nearest = std::round(p.x() / kPitch);
    testing::SurfacePoint lowest{1.0, {0.0, 0.0}, 0};
    for (double row = nearest - 1.0; row <= nearest + 1.0; row += 1.0) {
      const double x = p.x() - row * kPitch;
      const double root = std::sqrt(kRadius * kRadius - x * x);
      const double z = row_height(row) + kRadius - root;
      if (z < lowest.z) lowest = {z, {x / root, 0.0}, static_cast<std::int32_t>(row)};
    }
    return lowest;
  });
  const PolishedField part(scallops, kLens, {0.03, 0.0, 1.0});
  const SurfacePatch coarse = testing::sampled(part, testing::window_at({0.0, 0.0}, 0.01, 201, 4));
  const SurfacePatch fine = testing::sampled(part, testing::window_at({0.0, 0.0}, 0.001, 2001, 4));
  // Sums over nodes alone are off by up to 6e-4.
  for (std::size_t i = 20; i < 180; ++i) {
    EXPECT_NEAR(coarse.slope_x[i], fine.slope_x[10 * i], 3e-5) << i;
  }
}

TEST(PolishedField, SlopesAreThoseOfTheHeights) {
  const Formula surface([](double x, double y) {
    return Eigen::Vector3d(x * x * y + 0.3 * x, 2.0 * x * y + 0.3, x * x);
  });
  const PolishedField field(surface, kLens, {0.04, 0.02, 0.3});
  const GridWindow window = testing::window_at({0.5, 0.5}, 0.01, 30, 20);
  const SurfacePatch patch = testing::sampled(field, window);
  for (std::size_t j = 1; j < 19; ++j) {
    for (std::size_t i = 1; i < 29; ++i) {
      const std::size_t n = j * 30 + i;
      EXPECT_NEAR((patch.z[n + 1] - patch.z[n - 1]) / 0.02, patch.slope_x[n], 1e-4);
      EXPECT_NEAR((patch.z[n + 30] - patch.z[n - 30]) / 0.02, patch.slope_y[n], 1e-4);
    }
  }
}

TEST(PolishedField, OverPolishFallsOffFromTheRimAndTiltsItInwards) {
  const Formula surface(plane);
  const double depth = 0.02;
  const double length = 0.1;
  const SurfacePatch patch =
      testing::sampled(PolishedField(surface, kLens, {0.0, depth, length}), whole_lens());
  EXPECT_EQ(patch.cut[0], 7);
  for (std::int64_t i = 0; i < 201; ++i) {
    const Eigen::Vector2d q = patch.window.node(i, 75);
    const double low = depth * std::exp(-q.x() / length);
    const double high = depth * std::exp(-(2.0 - q.x()) / length);
    const double across = 2.0 * depth * std::exp(-0.75 / length);
    const auto n = static_cast<std::size_t>(75 * 201 + i);
    EXPECT_NEAR(patch.z[n], plane(q.x(), q.y())[0] - low - high - across, 1e-13);
    EXPECT_NEAR(patch.slope_x[n], 0.3 + (low - high) / length, 1e-13);
  }
}

TEST(PolishedField, WithoutPolishNothingChanges) {
  const Formula surface(plane);
  const SurfacePatch plain = testing::sampled(surface, whole_lens());
  const SurfacePatch patch = testing::sampled(PolishedField(surface, kLens, {}), whole_lens());
  EXPECT_EQ(patch.z, plain.z);
  EXPECT_EQ(patch.slope_x, plain.slope_x);
  EXPECT_EQ(patch.cut, plain.cut);
}

TEST(PolishedField, RefusesNumbersThatBreakTheirRule) {
  const Formula surface(plane);
  EXPECT_THROW(PolishedField(surface, kLens, {-0.01, 0.0, 1.0}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {0.01, -1.0, 1.0}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {0.01, 0.0, 0.0}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {std::nan(""), 0.0, 1.0}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {0.01, 0.0, 1.0, 3}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {0.01, 0.0, 1.0, 2, 1.0}), InputError);
  EXPECT_THROW(PolishedField(surface, kLens, {0.01, 0.0, 1.0, 2, -0.1}), InputError);
}

TEST(PolishedField, SameBitsForAnyTilesAndThreads) {
  const Formula surface([](double x, double y) {
    return Eigen::Vector3d(std::sin(9.0 * x) * y, 9.0 * std::cos(9.0 * x) * y, std::sin(9.0 * x));
  });
  for (const PolishModel& model :
       {PolishModel{0.03, 0.01, 0.2}, {0.03, 0.0, 1.0, 4}, {0.03, 0.0, 1.0, 2, 0.1}}) {
    testing::expect_same_bits_in_tiles(PolishedField(surface, kLens, model), whole_lens());
  }
}

}  // namespace
}  // namespace lensforge::milled_polished_test
