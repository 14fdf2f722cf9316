// SPDX-License-Identifier: GPL-3.0-or-later
// Haze against a random rough surface whose light is followed as a wave.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "core/lens/surface_field.h"
#include "core/optics/polish_transfer.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

constexpr double kWavelength = 550e-6;
constexpr double kSide = 2.0;       ///< Of the lens, mm.
constexpr double kDistance = 75.0;  ///< Of wall and focus, mm.
constexpr double kHeight = 3.0;     ///< Of the lens's middle, mm.
constexpr double kWall = 4.0;       ///< Side of the wall, mm.
constexpr int kPixels = 80;

/// A lens that focuses on the wall's middle, and a sum of random waves: with many of them heights
/// with a Gaussian distribution and the autocorrelation rms² exp(−r² / correlation²).
class RoughLens final : public SurfaceField {
 public:
  RoughLens(const Roughness& roughness, unsigned seed) {
    if (roughness.none()) return;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
    const double wave = std::numbers::sqrt2 / (1e-3 * roughness.correlation);
    amplitude_ = 1e-6 * roughness.rms * std::sqrt(2.0 / kWaves);
    for (int w = 0; w < kWaves; ++w) {
      waves_.emplace_back(wave * normal(random), wave * normal(random), phase(random));
    }
  }

  void sample(const GridWindow& window, const Executor& /*executor*/,
              SurfacePatch& patch) const override {
    resize_patch(window, false, patch);
    add_focus(window, patch);
    if (!waves_.empty()) add_waves(window, patch);
  }

 private:
  static constexpr int kWaves = 3000;

  /// The hyperbola that makes all paths to the focus equal, to fourth order.
  static void add_focus(const GridWindow& window, SurfacePatch& patch) {
    for (std::int64_t n = 0; n < window.size(); ++n) {
      const Eigen::Vector2d u =
          window.node(n % window.columns, n / window.columns).array() - 0.5 * kSide;
      const double f = kDistance;
      const double index = OpticalSetup().ior;
      // n z + √(r² + (f − z)²) = f: with h = −z, (n² − 1) h² + 2 f (n − 1) h = r².
      const double a = index * index - 1.0;
      const double b = f * (index - 1.0);
      const double root = std::sqrt(b * b + a * u.squaredNorm());
      const auto k = static_cast<std::size_t>(n);
      patch.z[k] = kHeight - u.squaredNorm() / (root + b);
      patch.slope_x[k] = -u.x() / root;
      patch.slope_y[k] = -u.y() / root;
    }
  }

  /// Σ cos(k·x + phase) as products of factors along x and y.
  void add_waves(const GridWindow& window, SurfacePatch& patch) const {
    const auto factors = [&](std::int64_t count, int axis) {
      Eigen::MatrixXcd e(count, kWaves);
      for (int w = 0; w < kWaves; ++w) {
        const Eigen::Vector3d& wave = waves_[static_cast<std::size_t>(w)];
        for (std::int64_t i = 0; i < count; ++i) {
          const double place = axis == 0 ? window.x(i) : window.y(i);
          e(i, w) = std::polar(1.0, wave[axis] * place + (axis == 0 ? wave[2] : 0.0));
        }
      }
      return e;
    };
    const Eigen::MatrixXcd x = factors(window.columns, 0);
    const Eigen::MatrixXcd y = factors(window.rows, 1);
    Eigen::VectorXcd kx(kWaves), ky(kWaves);
    for (int w = 0; w < kWaves; ++w) {
      kx[w] = {0.0, waves_[static_cast<std::size_t>(w)][0]};
      ky[w] = {0.0, waves_[static_cast<std::size_t>(w)][1]};
    }
    const Eigen::MatrixXd z = (x * y.transpose()).real();
    const Eigen::MatrixXd by_x = (x * kx.asDiagonal() * y.transpose()).real();
    const Eigen::MatrixXd by_y = (x * ky.asDiagonal() * y.transpose()).real();
    for (Eigen::Index n = 0; n < z.size(); ++n) {
      patch.z[static_cast<std::size_t>(n)] += amplitude_ * z(n);
      patch.slope_x[static_cast<std::size_t>(n)] += amplitude_ * by_x(n);
      patch.slope_y[static_cast<std::size_t>(n)] += amplitude_ * by_y(n);
    }
  }

  double amplitude_ = 0.0;
  std::vector<Eigen::Vector3d> waves_;  ///< Wave numbers along x and y, rad/mm, and phase.
};

OpticalSetup focus_setup() {
  OpticalSetup setup;
  setup.lens_size = {kSide, kSide};
  setup.image_size = {kWall, kWall};
  setup.image_origin = Eigen::Vector2d::Constant(0.5 * (kSide - kWall));
  setup.pixels = {kPixels, kPixels};
  setup.focal_length = kHeight + kDistance;
  return setup;
}

std::vector<double> picture_of(const Roughness& roughness, unsigned seed = 1) {
  const RoughLens lens(roughness, seed);
  const SurfaceField* const field = &lens;
  WaveOptions options;
  options.wavelength = kWavelength;
  options.tile = 0.0;
  options.scatter.setConstant(0.03);
  return wave_flux(focus_setup(), lens_grid({kSide, kSide}, 0.004), {&field, 1}, options,
                   Executor::cpu(2), {})
      .front();
}

/// Light in the ring from `low` to `high` mm around the focus, without the cross that the lens's
/// sides diffract.
double ring(const std::vector<double>& picture, double low, double high) {
  constexpr double kCross = 0.12;
  double sum = 0.0;
  for (std::size_t k = 0; k < picture.size(); ++k) {
    const double pixel = kWall / kPixels;
    const double x = pixel * (static_cast<double>(k % kPixels) + 0.5) - 0.5 * kWall;
    const std::size_t row = k / kPixels;
    const double y = pixel * (static_cast<double>(row) + 0.5) - 0.5 * kWall;
    const double r = std::hypot(x, y);
    const bool cross = std::abs(x) < kCross || std::abs(y) < kCross;
    if (!cross && r >= low && r < high) sum += picture[k];
  }
  return sum;
}

/// Share and distribution of what two random rough surfaces scatter as waves. The number of waves
/// and speckles in a ring bounds the agreement.
TEST(Haze, ARandomSurfaceScattersAsTheModelSays) {
  const std::vector<double> smooth = picture_of({});
  const OpticalSetup setup = focus_setup();
  for (const Roughness& roughness : {Roughness{15.0, 20.0}, {30.0, 30.0}}) {
    const Haze haze = haze_of(roughness, setup, kHeight, kWavelength);
    const std::vector<double> model = hazed(haze, smooth, setup.pixels, Executor::serial());
    std::vector<double> wave = picture_of(roughness, 1);
    const std::vector<double> other = picture_of(roughness, 2);
    for (std::size_t k = 0; k < wave.size(); ++k) wave[k] = 0.5 * (wave[k] + other[k]);
    const double sigma = haze.deviation.x() * kWall / kPixels;
    const double diffracted = ring(smooth, 0.0, kWall);
    EXPECT_LT(diffracted, 0.1 * haze.share);
    const auto compare = [&](double low, double high) {
      const double expected = ring(model, low * sigma, high * sigma);
      const double measured = ring(wave, low * sigma, high * sigma);
      EXPECT_NEAR(measured, expected, 0.1 * expected) << low << ' ' << high;
    };
    compare(0.0, 9.0);
    compare(0.5, 1.2);
    compare(1.2, 1.8);
    compare(1.8, 2.6);
  }
}

}  // namespace
}  // namespace lensforge
