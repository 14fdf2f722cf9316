// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar_goal.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <complex>
#include <random>
#include <stop_token>

#include "core/error.h"
#include "core/temp_folder.h"
#include "design/finite_difference.h"
#include "design/reflect/reflect_shape.h"
#include "fixtures/shapes/shapes.h"

// Lengths are millimetres; at 10 GHz a wavelength is 30 mm.
namespace lensforge::reflect {
namespace {

using Complex = std::complex<double>;
using lensforge::testing::TempFolder;

/// ∫ e^{iφ} over a triangle of area ½ by the midpoints of n² equal parts.
Complex summed_wave(const std::array<double, 3>& phase, int n) {
  Complex sum = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n - i; ++j) {
      for (const double third : {1.0, 2.0}) {
        if (third == 2.0 && i + j > n - 2) continue;
        const double u = (i + third / 3.0) / n;
        const double v = (j + third / 3.0) / n;
        sum += std::polar(1.0, phase[0] + u * (phase[1] - phase[0]) + v * (phase[2] - phase[0]));
      }
    }
  }
  return 0.5 * sum / static_cast<double>(n * n);
}

TEST(TriangleWave, IsTheIntegralAndItsDerivatives) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> spread(-1.0, 1.0);
  for (const double width : {1e-5, 1e-3, 0.1, 0.6, 3.0, 20.0}) {
    for (int i = 0; i < 20; ++i) {
      std::array<double, 3> phase{2.0 + width * spread(random), 2.0 + width * spread(random), 2.0};
      if (i % 4 == 1) phase[1] = phase[0];
      if (i % 4 == 2) phase[2] = phase[0] + 1e-4 * width;
      const TriangleWave wave = wave_with_slopes(phase);
      EXPECT_LT(std::abs(wave.value - summed_wave(phase, 200)), 1e-5 * (1.0 + width * width));
      for (std::size_t j = 0; j < 3; ++j) {
        constexpr double kStep = 1e-4;
        std::array<double, 3> more = phase;
        std::array<double, 3> less = phase;
        more[j] += kStep;
        less[j] -= kStep;
        const Complex slope =
            (wave_with_slopes(more).value - wave_with_slopes(less).value) / (2 * kStep);
        EXPECT_LT(std::abs(wave.by_phase[j] - slope), 1e-7) << width << " " << i;
      }
    }
  }
}

ReflectOptions radar_options() {
  ReflectOptions options;
  options.goal = GoalKind::kRadar;
  options.frequency = "10";
  options.sector = "0,360,10";
  options.radar_updates = 2;
  return options;
}

/// Half axes of two, one and three quarters of a wavelength.
SurfaceMesh body(int levels) {
  SurfaceMesh mesh = shapes::ellipsoid({60.0, 30.0, 22.5}, levels);
  mesh.vertices.row(2) += 0.2 * mesh.vertices.row(0);
  return mesh;
}

TEST(RadarEchoes, GradientMatchesFiniteDifferences) {
  const SurfaceMesh mesh = body(1);
  const RadarEchoes echoes(mesh, {{9.0, 10.0}, {3.0, 47.0, 100.0, 171.0, 260.0}},
                           Polarization::kVertical, Executor::serial());
  Eigen::Matrix3Xd gradient;
  // The echoes of the shape itself, by another formula.
  EXPECT_NEAR(echoes.value_and_gradient(mesh.vertices, gradient), echoes.mean(),
              1e-9 * echoes.mean());
  Eigen::Matrix3Xd near = mesh.vertices;
  near.row(0) += 0.02 * mesh.vertices.row(1);
  Eigen::Matrix3Xd ignored;
  const auto value = [&](const Eigen::VectorXd& x) {
    return echoes.value_and_gradient(x.reshaped(3, x.size() / 3), ignored);
  };
  echoes.value_and_gradient(near, gradient);
  EXPECT_LT(testing::plateau_error(gradient.reshaped(), value, near.reshaped(), 0.05), 1e-5);
}

TEST(RadarSector, HasMoreAzimuthsWhereLobesAreNarrow) {
  ReflectOptions options = radar_options();
  EXPECT_EQ(radar_sector(options, body(1)).azimuth_deg.size(), 108U);
  options.sector = "-30,30,2";
  const RadarSector narrow = radar_sector(options, body(1));
  EXPECT_EQ(narrow.azimuth_deg.size(), 31U);
  EXPECT_EQ(narrow.azimuth_deg.front(), -30.0);
  EXPECT_NEAR(narrow.azimuth_deg.back(), 30.0, 1e-9);
  options.frequency = "9,10,100";
  EXPECT_EQ(radar_sector(options, body(1)).azimuth_deg.size(), 151U);
}

TEST(RadarGoal, LowersTheMeanAndTheRestOfTheComputationConfirmsIt) {
  const SurfaceMesh mesh = body(3);
  ReflectOptions options = radar_options();
  options.radar_updates = 4;
  const ReflectInput input = prepared_input(mesh, "mesh", options);
  const ReflectResult result = reflect_shape(input, options, Executor::cpu(2), RunControl());
  EXPECT_LT(result.after.total, 0.5 * result.before.total);
  EXPECT_LT(result.max_displacement, 0.1);
  const Energies again = evaluate(result.mesh, options, Executor::cpu(2));
  EXPECT_NEAR(again.total, result.after.total, 1e-9 * again.total);
  ASSERT_TRUE(result.radar);
  EXPECT_NEAR(mean_dbsm(result.radar->after), mean_dbsm({again.total}), 1e-6);
}

TEST(RadarGoal, SameBitsForAnyNumberOfThreadsAndAfterAnInterruption) {
  const TempFolder folder;
  ReflectOptions options = radar_options();
  options.checkpoint = folder.path() / "checkpoint";
  const ReflectInput input = prepared_input(body(2), "mesh", options);
  const ReflectResult whole = reflect_shape(input, options, Executor::serial(), RunControl());
  ASSERT_EQ(whole.updates.size(), 2U);
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  const ReflectResult part = reflect_shape(input, options, Executor::cpu(2), control);
  EXPECT_FALSE(part.done());
  EXPECT_EQ(part.updates.size(), 1U);
  options.resume = true;
  const ReflectResult rest = reflect_shape(input, options, Executor::cpu(2), RunControl());
  EXPECT_EQ(rest.mesh.vertices, whole.mesh.vertices);
}

TEST(RadarGoal, FixedVerticesStayAndLimitsHold) {
  ReflectOptions options = radar_options();
  options.fix_plane = "1,0,0,-20";
  options.max_displacement = 1.0;
  const ReflectInput input = prepared_input(body(2), "mesh", options);
  const ReflectResult result = reflect_shape(input, options, Executor::cpu(2), RunControl());
  const Eigen::Matrix3Xd moved = result.mesh.vertices - result.reference.vertices;
  EXPECT_GT(moved.colwise().norm().maxCoeff(), 0.1);
  EXPECT_LE(moved.colwise().norm().maxCoeff(), 1.0 + 1e-9);
  for (Eigen::Index v = 0; v < moved.cols(); ++v) {
    if (input.fixed[static_cast<std::size_t>(v)] != 0) {
      EXPECT_LT(moved.col(v).norm(), 1e-12);
    }
  }
}

TEST(RadarGoal, BadOptionsAreRefused) {
  const auto refused = [](auto change) {
    ReflectOptions options = radar_options();
    change(options);
    EXPECT_THROW(validate(options), InputError);
  };
  for (const char* text : {"", "0", "-1", "12,8", "10,10", "2000", "a", "1,"}) {
    refused([&](ReflectOptions& o) { o.frequency = text; });
  }
  for (const char* text : {"0,0,2", "90,0,2", "0,400,2", "0,10,0", "0,10,20", "0,10", "0,10,nan"}) {
    refused([&](ReflectOptions& o) { o.sector = text; });
  }
  refused([](ReflectOptions& o) { o.goal = GoalKind::kStealth; });
  refused([](ReflectOptions& o) { o.radar_ghz = 10.0; });
  refused([](ReflectOptions& o) { o.light = "0,0,1"; });
  refused([](ReflectOptions& o) { o.place = "0,0,1"; });
  refused([](ReflectOptions& o) { o.method = Method::kPaper; });
  refused([](ReflectOptions& o) { o.denoise = 250.0; });
  refused([](ReflectOptions& o) { o.elevation_deg = 10.0; });
  refused([](ReflectOptions& o) { o.rim_updates = 5; });
  refused([](ReflectOptions& o) { o.split = false; });
  ReflectOptions light;
  light.radar_updates = 5;
  EXPECT_THROW(validate(light), InputError);
}

}  // namespace
}  // namespace lensforge::reflect
