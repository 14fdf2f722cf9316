// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/predict/printed_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>

#include "cam/milled/polished_field.h"

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// Height of a surface, and its slopes by differences.
class HeightField final : public SurfaceField {
 public:
  using Height = std::function<double(double, double)>;
  explicit HeightField(Height height) : height_(std::move(height)) {}

  void sample(const GridWindow& window, const Executor& /*executor*/,
              SurfacePatch& patch) const override {
    constexpr double kApart = 1e-5;
    resize_patch(window, false, patch);
    for (std::int64_t j = 0; j < window.rows; ++j) {
      for (std::int64_t i = 0; i < window.columns; ++i) {
        const auto n = static_cast<std::size_t>(j * window.columns + i);
        const double x = window.x(i);
        const double y = window.y(j);
        patch.z[n] = height_(x, y);
        patch.slope_x[n] = (height_(x + kApart, y) - height_(x - kApart, y)) / (2.0 * kApart);
        patch.slope_y[n] = (height_(x, y + kApart) - height_(x, y - kApart)) / (2.0 * kApart);
      }
    }
  }

 private:
  Height height_;
};

SurfacePatch levelled(const SurfaceField& surface, const Printer& printer,
                      const GridWindow& window) {
  const PrintedField printed(surface, printer);
  const Eigen::AlignedBox2d lens(Eigen::Vector2d(-100.0, -100.0), Eigen::Vector2d(100.0, 100.0));
  const PolishedField part(printed, lens, film_of(printer));
  SurfacePatch patch;
  part.sample(window, Executor::serial(), patch);
  return patch;
}

/// Amplitude of the k-th harmonic of the steps of a plane of this slope, over one period along x.
double harmonic(const Printer& printer, double slope, int k) {
  constexpr int kNodes = 64;
  const double period = printer.step() / slope;
  const HeightField plane([&](double x, double /*y*/) { return slope * x; });
  const GridWindow window{{0.0, 0.0}, {period / kNodes, period / kNodes}, kNodes, 1, 0, 0};
  const SurfacePatch patch = levelled(plane, printer, window);
  std::complex<double> sum = 0.0;
  for (int i = 0; i < kNodes; ++i) {
    const double excess = patch.z[static_cast<std::size_t>(i)] - slope * window.x(i);
    sum += excess * std::polar(1.0, -kTwoPi * k * i / kNodes);
  }
  return 2.0 * std::abs(sum) / kNodes;
}

Printer fine_printer(int order) {
  Printer printer;
  printer.layer = 0.05;
  printer.pixel = 0.002;
  printer.film_sigma = 0.2;
  printer.film_order = order;
  return printer;
}

TEST(PrintedField, StepsOfATiltedPlaneAreTheFourierSeriesOfASawtoothBehindTheFilm) {
  constexpr double kSlope = 0.05;
  for (const int order : {2, 4}) {
    const Printer printer = fine_printer(order);
    for (const int k : {1, 2}) {
      const double wave = kTwoPi * k * kSlope / printer.layer;
      const double film = std::exp(-std::pow(printer.film_sigma * wave / std::sqrt(2.0), order));
      const double expected = printer.layer / (std::numbers::pi * k) * film;
      const double rounding = 2e-4 * printer.layer;  // Of the film's kernel, and of pixels.
      EXPECT_NEAR(harmonic(printer, kSlope, k), expected, 2e-3 * expected + rounding)
          << order << " " << k;
    }
    const double first = harmonic(printer, kSlope, 1) * kTwoPi * kSlope / printer.layer;
    EXPECT_NEAR(step_slope(printer, kSlope), first, 5e-3 * first);
  }
}

TEST(PrintedField, HeightsAreThoseOfAllPixelsAveragedOneByOne) {
  Printer printer;
  printer.layer = 0.05;
  printer.pixel = 0.035;
  printer.film_sigma = 0.15;
  printer.film_order = 2;
  const auto height = [](double x, double y) {
    return 0.08 * x + 0.003 * std::sin(2.0 * x + y) + 0.002 * y * y;
  };
  const HeightField surface(height);
  const GridWindow window{{0.0, 0.0}, {0.0375, 0.0375}, 12, 12, -6, -6};
  const SurfacePatch patch = levelled(surface, printer, window);
  const double sigma = printer.film_sigma;
  double worst = 0.0;
  double steps = 0.0;
  for (std::int64_t j = 0; j < window.rows; j += 3) {
    for (std::int64_t i = 0; i < window.columns; i += 3) {
      const Eigen::Vector2d at = window.node(i, j);
      // Weights of a pixel: integrals of the Gaussian over it.
      const auto weight = [&](double middle, double from) {
        const double scale = std::sqrt(2.0) * sigma;
        return 0.5 * (std::erf((middle + 0.5 * printer.pixel - from) / scale) -
                      std::erf((middle - 0.5 * printer.pixel - from) / scale));
      };
      double printed = 0.0;
      double meant = 0.0;
      for (int v = -40; v <= 40; ++v) {
        for (int u = -40; u <= 40; ++u) {
          const double x = u * printer.pixel;
          const double y = v * printer.pixel;
          const double share = weight(x, at.x()) * weight(y, at.y());
          printed += share * printer.layer * std::round(height(x, y) / printer.layer);
          meant += share * height(x, y);
        }
      }
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      worst = std::max(worst, std::abs(patch.z[n] - printed));
      steps = std::max(steps, std::abs(printed - meant));
    }
  }
  EXPECT_GT(steps, 1e-3);
  EXPECT_LT(worst, 0.02 * steps);
}

TEST(PrintedField, UprightThePixelsAreTheSteps) {
  Printer printer;
  printer.pixel = 0.04;
  printer.layer = 0.03;
  printer.upright = true;
  const HeightField surface([](double x, double y) { return 0.31 * x + 0.47 * y + 0.0037; });
  // Cells that lie in one pixel have its height.
  const GridWindow window{{0.0, 0.0}, {0.0133, 0.0099}, 30, 30, 0, 0};
  SurfacePatch patch;
  PrintedField(surface, printer).sample(window, Executor::serial(), patch);
  for (std::int64_t j = 0; j < window.rows; ++j) {
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const double x = 0.04 * std::round(window.x(i) / 0.04);
      const double y = 0.03 * std::round(window.y(j) / 0.03);
      if (std::abs(window.x(i) - x) > 0.013 || std::abs(window.y(j) - y) > 0.01) continue;
      const double z = patch.z[static_cast<std::size_t>(j * window.columns + i)];
      EXPECT_NEAR(z, 0.04 * std::round((0.31 * x + 0.47 * y + 0.0037) / 0.04), 1e-12)
          << x << " " << y;
    }
  }
}

TEST(PrintRun, TimeIsThatOfTheLayers) {
  Printer printer;  // Layers of 0.025 mm, 8 s each, 5 minutes before.
  const PrintRun flat = print_run(printer, {80.0, 60.0}, 7.9);
  EXPECT_EQ(flat.layers, 316);
  EXPECT_DOUBLE_EQ(flat.minutes, 5.0 + 316.0 * 8.0 / 60.0);
  printer.upright = true;
  const PrintRun upright = print_run(printer, {80.0, 60.0}, 7.9);
  EXPECT_EQ(upright.layers, 2400);
  EXPECT_EQ(upright.box, Eigen::Vector3d(80.0, 7.9, 60.0));
}

TEST(PrintRun, APartMayBeTurnedOnTheBed) {
  const Printer printer;  // 130 × 80 × 160 mm
  EXPECT_TRUE(fits_bed(printer, {80.0, 130.0, 160.0}));
  EXPECT_FALSE(fits_bed(printer, {80.5, 130.0, 10.0}));
  EXPECT_FALSE(fits_bed(printer, {81.0, 81.0, 10.0}));
  EXPECT_FALSE(fits_bed(printer, {10.0, 10.0, 160.5}));
}

TEST(PrintRun, TheLargestRippleOfStepsIsThatOfAllSlopes) {
  for (const int order : {2, 4}) {
    Printer printer;
    printer.film_order = order;
    double largest = 0.0;
    for (double slope = 1e-4; slope < 1.0; slope *= 1.01) {
      largest = std::max(largest, step_slope(printer, slope));
    }
    EXPECT_NEAR(largest_step_slope(printer), largest, 1e-3 * largest);
    EXPECT_EQ(slope_with_steps(printer, 1.01 * largest), 0.0);
    const double steepest = slope_with_steps(printer, 0.1 * largest);
    EXPECT_NEAR(step_slope(printer, steepest), 0.1 * largest, 1e-9);
    EXPECT_LT(step_slope(printer, 1.01 * steepest), 0.1 * largest);
  }
}

}  // namespace
}  // namespace lensforge
