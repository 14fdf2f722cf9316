// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/wave_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstddef>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

#include "cam/analytic_fields.h"
#include "core/image/color.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "design/render.h"

namespace lensforge::wave_picture_test {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kHeight = 3.0;  ///< Of flat surfaces, mm.

/// A surface from its formula, f(x, y) = z and slopes.
template <class Formula>
testing::AnalyticField surface_of(const Formula& f) {
  const auto point = [f](const Eigen::Vector2d& at) {
    const Eigen::Vector3d value = f(at.x(), at.y());
    return testing::SurfacePoint{value[0], value.tail<2>(), 0};
  };
  return testing::AnalyticField(point, false);
}

/// A square lens before a wall of as many pixels, 75 mm from the surface.
OpticalSetup setup_of(double side, int pixels, double distance = 75.0) {
  OpticalSetup setup;
  setup.lens_size = {side, side};
  setup.image_size = {side, side};
  setup.pixels = {pixels, pixels};
  setup.focal_length = kHeight + distance;
  return setup;
}

WaveOptions in_one_piece() {
  WaveOptions options;
  options.tile = 0.0;
  return options;
}

/// @param bend  length over which the surface bends smoothly, mm.
std::vector<double> waves(const OpticalSetup& setup, const SurfaceField& surface,
                          const WaveOptions& options, double bend = 0.08, int threads = 2) {
  const SurfaceField* const one = &surface;
  return wave_flux(setup, lens_grid(setup.lens_size, 0.25 * bend), {&one, 1}, options,
                   Executor::cpu(threads), {})
      .front();
}

double sum_of(const std::vector<double>& flux) {
  return std::accumulate(flux.begin(), flux.end(), 0.0);
}

/// Mean absolute difference of two pictures as a display shows them.
double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  const auto count = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += std::abs(encode(0.5 * count * a[i]) - encode(0.5 * count * b[i]));
  }
  return sum / count;
}

/// Light of every pixel behind a slit of width `side`, as shares of it (Goodman, section 4.5.1).
std::vector<double> slit(double side, int pixels, double distance, double wavelength) {
  constexpr int kParts = 60;
  const double scale = std::sqrt(2.0 / (wavelength * distance));
  std::vector<double> light(static_cast<std::size_t>(pixels), 0.0);
  for (int k = 0; k < pixels * kParts; ++k) {
    const double x = side * (k + 0.5) / (pixels * kParts);
    std::complex<double> sum = 0.0;
    constexpr int kSteps = 4000;
    for (int s = 0; s < kSteps; ++s) {
      const double t = scale * (side * (s + 0.5) / kSteps - x);
      sum += std::polar(scale * side / kSteps, 0.5 * std::numbers::pi * t * t);
    }
    light[static_cast<std::size_t>(k / kParts)] += 0.5 * std::norm(sum) / (pixels * kParts);
  }
  return light;
}

TEST(WavePicture, AFlatLensIsASquareAperture) {
  const OpticalSetup setup = setup_of(2.0, 16);
  const auto flat = surface_of([](double, double) { return Eigen::Vector3d(kHeight, 0.0, 0.0); });
  const std::vector<double> one = slit(2.0, 16, 75.0, 550e-6);
  // As finely as it takes, and by default.
  WaveOptions fine = in_one_piece();
  fine.scatter.setConstant(0.04);
  for (const WaveOptions& options : {fine, WaveOptions{550e-6, {0.0, 0.0}, 3.0, 1.5}}) {
    const std::vector<double> flux = waves(setup, flat, options, 0.04);
    for (int row = 0; row < 16; ++row) {
      for (int column = 0; column < 16; ++column) {
        const double expected =
            256.0 * one[static_cast<std::size_t>(row)] * one[static_cast<std::size_t>(column)];
        EXPECT_NEAR(256.0 * flux[static_cast<std::size_t>(row * 16 + column)], expected,
                    options.tile > 0.0 ? 0.03 : 2e-3)
            << row << ' ' << column;
      }
    }
  }
}

/// A hyperbola sends all its light to one line; the line's light is sinc².
TEST(WavePicture, ACylindersFocusIsASinc) {
  constexpr double kSide = 1.6;
  constexpr double kDistance = 75.0;
  constexpr double kIndex = 1.49;
  OpticalSetup setup = setup_of(kSide, 80);
  setup.ior = kIndex;
  setup.image_size.y() = 2.0 * kSide;
  setup.image_origin.y() = -0.5 * kSide;
  setup.pixels = {80, 4};
  // n z + √(x² + (D − z)²) is the same for all x, z from the apex on.
  const auto lens = surface_of([&](double x, double) {
    const double u = x - 0.5 * kSide;
    const double a = kIndex * kIndex - 1.0;
    const double b = kDistance * (kIndex - 1.0);
    // (n² − 1) z² − 2 b z + … of (D + z (…)): solved for z ≤ 0.
    const double z = (b - std::sqrt(b * b + a * u * u)) / a;
    const double root = std::sqrt(b * b + a * u * u);
    return Eigen::Vector3d(kHeight + z, -u / root, 0.0);
  });
  WaveOptions options = in_one_piece();
  options.scatter.setConstant(0.06);
  const std::vector<double> flux = waves(setup, lens, options, 0.02);
  const double pixel = kSide / 80.0;
  for (int column = 30; column < 50; ++column) {
    double expected = 0.0;
    for (int k = 0; k < 50; ++k) {
      const double x = (column - 40 + (k + 0.5) / 50.0) * pixel;
      const double t = std::numbers::pi * kSide * x / (550e-6 * kDistance);
      const double sinc = std::abs(t) < 1e-9 ? 1.0 : std::sin(t) / t;
      expected += sinc * sinc / 50.0 * pixel * kSide / (550e-6 * kDistance);
    }
    double light = 0.0;
    for (std::size_t row = 0; row < 4; ++row) {
      light += flux[row * 80 + static_cast<std::size_t>(column)];
    }
    // Of all light; 0.2 % of the peak spills over the picture's ends along the line.
    EXPECT_NEAR(light, expected, 2.5e-3) << column;
  }
}

/// A ripple of 30 nm and of 120 nm sends J_m² of the light into order m, whatever its slopes.
TEST(WavePicture, OrdersOfASinusoidalRippleAreBessels) {
  constexpr double kPeriod = 0.06;
  constexpr double kSide = 1.2;
  for (const double amplitude : {30e-6, 120e-6}) {
    OpticalSetup setup = setup_of(kSide, 4);
    setup.image_size = {9.0, kSide};
    setup.image_origin = {-3.9, 0.0};
    setup.pixels = {180, 1};
    const auto ripple = surface_of([&](double x, double) {
      const double phase = kTwoPi * x / kPeriod;
      return Eigen::Vector3d(kHeight + amplitude * std::sin(phase),
                             kTwoPi * amplitude / kPeriod * std::cos(phase), 0.0);
    });
    WaveOptions options = in_one_piece();
    options.scatter.setConstant(5.0 * options.wavelength / kPeriod);
    const std::vector<double> flux = waves(setup, ripple, options, 0.01);
    const double depth = kTwoPi * (setup.ior - 1.0) * amplitude / options.wavelength;
    const double apart = 75.0 * options.wavelength / kPeriod;  // 0.69 mm
    for (int order = -3; order <= 3; ++order) {
      // The order's light is as wide as the lens; orders overlap, so their sums are compared over
      // windows around them.
      double light = 0.0;
      double expected = 0.0;
      for (int column = 0; column < 180; ++column) {
        const double x = -3.9 + (column + 0.5) * 0.05 - 0.5 * kSide;
        if (std::abs(x - order * apart) > 0.3) continue;
        light += flux[static_cast<std::size_t>(179 - column)];
        for (int m = -8; m <= 8; ++m) {
          const double bessel = std::cyl_bessel_j(std::abs(m), depth);
          if (std::abs(x - m * apart) <= 0.5 * kSide) expected += bessel * bessel * 0.05 / kSide;
        }
      }
      EXPECT_NEAR(light, expected, 0.02) << order << ' ' << amplitude;
    }
  }
}

/// Gentle bumps, as of a lens; their rays do not cross before the wall.
Eigen::Vector3d bump(double x, double y) {
  constexpr double kHigh = 4e-4;
  const double kx = kTwoPi / 1.3;
  const double ky = kTwoPi / 1.7;
  return {kHeight + kHigh * std::sin(kx * x) * std::cos(ky * y),
          kHigh * kx * std::cos(kx * x) * std::cos(ky * y),
          -kHigh * ky * std::sin(kx * x) * std::sin(ky * y)};
}

auto bumps() {
  return surface_of([](double x, double y) { return bump(x, y); });
}

TEST(WavePicture, TilesHaveThePictureOfOnePiece) {
  const OpticalSetup setup = setup_of(9.6, 48);
  WaveOptions finest = in_one_piece();
  finest.scatter.setConstant(0.04);
  const std::vector<double> whole = waves(setup, bumps(), finest);
  EXPECT_LT(difference(waves(setup, bumps(), {}), whole), 2e-4);
  EXPECT_NEAR(sum_of(whole), 1.0, 0.02);
}

/// A place of a lens is a rectangle: what rectangles side by side send is what the lens does.
TEST(WavePicture, PartsSideBySideAddUpToTheWhole) {
  const GridWindow grid = lens_grid({6.4, 6.4}, 0.02);
  const auto surface = bumps();
  OpticalSetup near = setup_of(6.4, 32);
  near.lamp = PointSource{{3.2, 3.2, -400.0}};
  near.image_size *= 1.2;
  near.image_origin.setConstant(-0.64);
  for (const OpticalSetup& setup : {setup_of(6.4, 32), near}) {
    const LightPath light(setup);
    // Of the flat surface, which the bumps change by their slopes alone.
    const double whole =
        light.intake({{0.0, 0.0, kHeight}, {6.4, 0.0, kHeight}, {6.4, 6.4, kHeight}}) +
        light.intake({{0.0, 0.0, kHeight}, {6.4, 6.4, kHeight}, {0.0, 6.4, kHeight}});
    std::vector<double> sum(32 * 32, 0.0);
    for (const CellRange& cells : {CellRange{0, 0, 150, 200}, CellRange{150, 0, 170, 200},
                                   CellRange{0, 200, 150, 120}, CellRange{150, 200, 170, 120}}) {
      const std::vector<double> one =
          wave_flux_of({grid, cells, {&whole, 1}}, setup, surface, {}, Executor::cpu(2), {});
      EXPECT_NEAR(sum_of(one), static_cast<double>(cells.columns * cells.rows) / (320 * 320), 0.02);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += one[i];
    }
    // Parts of 3 mm, 15 coherence lengths: smaller than tiles.
    EXPECT_LT(difference(sum, waves(setup, surface, {})), 5e-4);
  }
}

/// The picture of rays from the same surface.
std::vector<double> rays(const OpticalSetup& setup) {
  const int nodes = static_cast<int>(std::lround(50.0 * setup.lens_size.x())) + 1;
  SampledSurface samples = make_samples({nodes, nodes});
  for (int j = 0; j < nodes; ++j) {
    for (int i = 0; i < nodes; ++i) {
      const Eigen::Vector3d one = bump(0.02 * i, 0.02 * j);
      samples.mesh.vertices.col(j * nodes + i) << 0.02 * i, 0.02 * j, one[0];
      samples.normals.col(j * nodes + i) << -one[1], -one[2], 1.0;
    }
  }
  return flux_of_surface(samples.mesh, samples.normals, setup, Executor::cpu(2));
}

/// What differs is mostly at the rim, within √(λ f) of it.
TEST(WavePicture, NearsThatOfRaysAsTheWavelengthFalls) {
  const OpticalSetup setup = setup_of(3.2, 16);
  const std::vector<double> limit = rays(setup);
  WaveOptions options;
  const double usual = difference(waves(setup, bumps(), options), limit);
  options.wavelength *= 0.1;
  const double tenth = difference(waves(setup, bumps(), options), limit);
  EXPECT_GT(usual, 2e-3);
  EXPECT_LT(tenth, 1.3 * std::sqrt(0.1) * usual);
}

TEST(WavePicture, IsTheSameFromHalfTheSpacing) {
  const OpticalSetup setup = setup_of(4.8, 24);
  EXPECT_LT(difference(waves(setup, bumps(), {}), waves(setup, bumps(), {}, 0.04)), 5e-5);
}

TEST(WavePicture, OfAFarPointIsThatOfParallelLight) {
  const OpticalSetup setup = setup_of(4.8, 24);
  OpticalSetup far = setup;
  far.lamp = PointSource{{2.4, 2.4, -1e6}};
  EXPECT_LT(difference(waves(setup, bumps(), {}), waves(far, bumps(), {})), 1e-4);
}

/// Light that falls in at an angle goes on at one: the wall is where it lands.
TEST(WavePicture, OfTiltedLightIsMovedAlong) {
  const OpticalSetup setup = setup_of(4.8, 24);
  OpticalSetup tilted = setup;
  const double sine = 0.2;
  tilted.lamp = ParallelLight{{sine, 0.0, std::sqrt(1.0 - sine * sine)}};
  const double moved = 75.0 * sine / std::sqrt(1.0 - sine * sine);
  tilted.image_origin.x() += moved;
  // Bumps deflect a little more where light comes out at an angle.
  EXPECT_LT(difference(waves(setup, bumps(), {}), waves(tilted, bumps(), {})), 0.02);
  const std::vector<double> flux = waves(tilted, bumps(), {});
  EXPECT_LT(difference(flux, rays(tilted)),
            2.0 * difference(waves(setup, bumps(), {}), rays(setup)));
}

/// Light of every column behind a mirror of one curvature, in parallel light, by the integral over
/// cylinder waves along the surface itself (Goodman, section 3.5): no plane, no parabola.
std::vector<double> by_integral(const OpticalSetup& setup,
                                const std::function<Eigen::Vector3d(double, double)>& surface) {
  constexpr int kSteps = 16000;
  constexpr int kParts = 64;
  const Eigen::Vector3d& from = std::get<ParallelLight>(setup.lamp).direction;
  const int columns = setup.pixels.x();
  std::vector<double> light(static_cast<std::size_t>(columns), 0.0);
  for (int k = 0; k < columns * kParts; ++k) {
    const double x = setup.image_size.x() * ((k + 0.5) / (columns * kParts) - 0.5);
    const Eigen::Vector2d across(setup.screen_x.x(), setup.screen_x.z());
    const Eigen::Vector2d place =
        Eigen::Vector2d(setup.screen_centre().x(), setup.focal_length) + x * across;
    std::complex<double> sum = 0.0;
    std::complex<double> through = 0.0;  // Of its derivative across the screen.
    for (int s = 0; s < kSteps; ++s) {
      const double u = setup.lens_size.x() * (s + 0.5) / kSteps;
      const Eigen::Vector3d at = surface(u, 0.0);
      const Eigen::Vector2d way = place - Eigen::Vector2d(u, at[0]);
      const double length = way.norm();
      // Not of unit length, since dA is not, either.
      const Eigen::Vector2d normal(-at[1], 1.0);
      const double cosines =
          normal.dot(way) / length - normal.dot(Eigen::Vector2d(from.x(), from.z()));
      const double path = from.x() * u + from.z() * at[0] + length;
      const std::complex<double> wave =
          std::polar(cosines / std::sqrt(length), kTwoPi * path / 550e-6);
      sum += wave;
      through += (across.x() * way.y() - across.y() * way.x()) / length * wave;
    }
    // Seen from the lamp's side columns run against x.
    light[static_cast<std::size_t>(columns - 1 - k / kParts)] += (std::conj(sum) * through).real();
  }
  const double whole = sum_of(light);
  for (double& one : light) one /= whole;
  return light;
}

constexpr double kMirrorSide = 4.0;

/// A mirror that spreads oblique light to four times its width.
OpticalSetup oblique_mirror() {
  OpticalSetup setup = setup_of(kMirrorSide, 24, 40.0);
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  setup.lens_size.y() = 1.0;
  setup.image_origin = {16.0, -1.0};
  setup.image_size = {20.0, 3.0};
  setup.pixels = {40, 6};
  return setup;
}

/// @param high  of its ripples, mm.
std::function<Eigen::Vector3d(double, double)> mirror_profile(double high) {
  return [high](double x, double) {
    constexpr double kBend = -0.028;
    constexpr double kTurns = kTwoPi / 0.9;
    const double u = x - 0.5 * kMirrorSide;
    return Eigen::Vector3d(kHeight + 0.5 * kBend * u * u + high * std::sin(kTurns * u),
                           kBend * u + high * kTurns * std::cos(kTurns * u), 0.0);
  };
}

/// Of the columns' light, a share of all.
double column_error(const std::vector<double>& flux, const std::vector<double>& expected) {
  double error = 0.0;
  for (std::size_t column = 0; column < 40; ++column) {
    double light = 0.0;
    for (std::size_t row = 0; row < 6; ++row) light += flux[row * 40 + column];
    error += std::abs(light - expected[column]);
  }
  return error;
}

/// On planes z = const it was 0.0050 and 0.0084.
TEST(WavePicture, OfAnObliqueMirrorIsTheIntegralOverIt) {
  const OpticalSetup setup = oblique_mirror();
  const auto profile = mirror_profile(3e-4);
  const std::vector<double> expected = by_integral(setup, profile);
  for (const WaveOptions& options : {WaveOptions{550e-6, {0.0, 0.0}, 8.0, 3.0}, in_one_piece()}) {
    const std::vector<double> flux = waves(setup, surface_of(profile), options);
    EXPECT_LT(column_error(flux, expected), 0.004) << options.tile;
  }
}

/// Light of one tile that meets a screen at 37° goes up to 12 mm from the plane in its middle.
TEST(WavePicture, OnATiltedScreenIsTheIntegral) {
  OpticalSetup setup = oblique_mirror();
  setup.screen_x = {std::cos(0.4), 0.0, std::sin(0.4)};
  setup.image_origin.x() -= 10.0;
  setup.image_size.x() = 40.0;
  const auto profile = mirror_profile(3e-3);
  const std::vector<double> expected = by_integral(setup, profile);
  const auto error = [&](double stray) {
    WaveOptions options = in_one_piece();
    options.stray = stray;
    return column_error(waves(setup, surface_of(profile), options), expected);
  };
  EXPECT_LT(error(0.05), 0.01);
  EXPECT_GT(error(HUGE_VAL), 0.03);  // On one plane.
}

TEST(WavePicture, SameBitsForAnyNumberOfThreads) {
  const OpticalSetup setup = setup_of(6.4, 32);
  WaveOptions tiles;
  tiles.tile = 8.0;
  EXPECT_EQ(waves(setup, bumps(), tiles, 0.08, 1), waves(setup, bumps(), tiles, 0.08, 3));
}

}  // namespace
}  // namespace lensforge::wave_picture_test
