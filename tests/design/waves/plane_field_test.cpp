// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "design/waves/wave_tile.h"

namespace lensforge::plane_field_test {
namespace {

constexpr double kWavelength = 550e-6;
constexpr double kWaveNumber = 2.0 * std::numbers::pi / kWavelength;

FieldPlan plan_of(double distance, double step, int size) {
  FieldPlan plan;
  plan.wavelength = kWavelength;
  plan.distance = distance;
  plan.centre = {3.0, -2.0};
  plan.step = {step, step};
  plan.columns = size;
  plan.rows = size;
  plan.reach = Eigen::Vector2d::Constant(0.5 * size * step);
  return plan;
}

template <class Value>
PlaneField field_of(const FieldPlan& plan, const Value& value) {
  PlaneField field(plan);
  for (int j = 0; j < plan.rows; ++j) {
    for (int i = 0; i < plan.columns; ++i) {
      field.at(i, j) = std::complex<float>(std::complex<double>(
          value((i - plan.middle().x()) * plan.step.x(), (j - plan.middle().y()) * plan.step.y())));
    }
  }
  return field;
}

TEST(PlaneField, AGaussianBeamWidensAsTheClosedFormSays) {
  constexpr double kWaist = 0.1;
  PlaneField field = field_of(plan_of(75.0, 0.008, 256), [](double x, double y) {
    return std::complex<double>(std::exp(-(x * x + y * y) / (kWaist * kWaist)), 0.0);
  });
  field.propagate();
  const double rayleigh = std::numbers::pi * kWaist * kWaist / kWavelength;
  const double wider = 1.0 + std::pow(75.0 / rayleigh, 2);
  for (int i = 60; i < 196; ++i) {
    const double x = (i - 128) * 0.008;
    const double expected = std::exp(-2.0 * x * x / (kWaist * kWaist * wider)) / wider;
    EXPECT_NEAR(std::norm(field.at(i, 128)), expected, 1e-3 / wider) << x;
    EXPECT_NEAR(std::norm(field.at(128, i)), expected, 1e-3 / wider) << x;
  }
}

/// Intensity behind a slit of half width a at x: |∫ exp(iπ t²/2)|²/2 (Goodman, section 4.5.1), by a
/// fine sum.
double slit(double x, double a, double distance) {
  const double scale = std::sqrt(2.0 / (kWavelength * distance));
  const double from = -scale * (a + x);
  const double to = scale * (a - x);
  constexpr int kSteps = 20000;
  std::complex<double> sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double t = from + (to - from) * (k + 0.5) / kSteps;
    sum += std::polar((to - from) / kSteps, 0.5 * std::numbers::pi * t * t);
  }
  return 0.5 * std::norm(sum);
}

TEST(PlaneField, ASquareApertureHasFresnelsPattern) {
  constexpr double kHalf = 0.5;
  constexpr double kStep = 0.004;
  // The edge lies in the middle between nodes.
  PlaneField field = field_of(plan_of(75.0, kStep, 800), [](double x, double y) {
    const bool in = std::abs(x + 0.5 * kStep) < kHalf && std::abs(y + 0.5 * kStep) < kHalf;
    return std::complex<double>(in ? 1.0 : 0.0, 0.0);
  });
  field.propagate();
  // Means over pixels of 0.1 mm, as a picture has them.
  double mean_y = 0.0;
  for (int k = -12; k <= 12; ++k) mean_y += slit((k + 0.5) * kStep, kHalf, 75.0) / 25.0;
  for (double x = -0.6; x < 0.65; x += 0.1) {
    const int first = 400 + static_cast<int>(std::lround(x / kStep));
    double mean = 0.0;
    double expected = 0.0;
    for (int k = -12; k <= 12; ++k) {
      for (int j = 388; j <= 412; ++j) mean += std::norm(field.at(first + k, j)) / 625.0;
      expected += slit((first + k - 400 + 0.5) * kStep, kHalf, 75.0) / 25.0 * mean_y;
    }
    EXPECT_NEAR(mean, expected, 2e-3) << x;
  }
}

/// On the axis behind a circular aperture (Rayleigh and Sommerfeld, exact).
TEST(PlaneField, OnTheAxisOfACircularApertureTheRimInterferes) {
  constexpr double kRadius = 0.4;
  constexpr double kStep = 0.004;
  for (const double distance : {60.0, 75.0, 150.0}) {
    PlaneField field = field_of(plan_of(distance, kStep, 700), [](double x, double y) {
      // The share of the node's cell inside.
      const double r = std::hypot(x, y);
      return std::complex<double>(std::clamp((kRadius - r) / 0.004 + 0.5, 0.0, 1.0), 0.0);
    });
    field.propagate();
    const double rim = std::hypot(kRadius, distance);
    const std::complex<double> expected = std::polar(1.0, kWaveNumber * distance) -
                                          distance / rim * std::polar(1.0, kWaveNumber * rim);
    // Of at most 4.
    EXPECT_NEAR(std::norm(field.at(350, 350)), std::norm(expected), 1e-2) << distance;
  }
}

/// Rays that came to a line of focus and went on, laid on a plane beyond it: they are turned over,
/// a quarter of a wave late, and make the same field there as the wave that was propagated, but for
/// what the beam of finite width diffracts (0.06 rad along the line).
TEST(PlaneField, RaysBeyondAFoldHaveTheFieldOfTheWave) {
  constexpr double kFocus = 20.0;
  constexpr double kWidth = 0.25;
  const FieldPlan plan = plan_of(2.0 * kFocus, 0.004, 512);
  PlaneField before = field_of(plan, [](double x, double y) {
    return std::polar(std::exp(-(x * x + y * y) / (kWidth * kWidth)),
                      -kWaveNumber * (std::hypot(x, kFocus) - kFocus));
  });
  before.propagate();
  PlaneField rays(plan);
  constexpr int kRays = 200;
  constexpr double kApart = 0.01;
  const auto vertex = [&](int i, int j) {
    const double x = (i - 0.5 * kRays) * kApart;
    const double y = (j - 0.5 * kRays) * kApart;
    PlaneField::Vertex v;
    v.place = plan.centre + Eigen::Vector2d(-x, y);
    const double length = std::hypot(x, kFocus);
    v.cosine = {-x / length, 0.0};
    // Up to the plane: what the converging wave lacks, and twice the way to the line.
    v.path = length + kFocus;
    v.amplitude = std::exp(-(x * x + y * y) / (kWidth * kWidth));
    return PlaneField::corner(plan, v);
  };
  for (int j = 0; j < kRays; ++j) {
    for (int i = 0; i < kRays; ++i) {
      rays.add({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      rays.add({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
  }
  rays.lay_rest();
  // The propagated field lacks the phase of the way along the axis.
  const std::complex<double> axis = std::polar(1.0, kWaveNumber * 2.0 * kFocus);
  for (const auto& [i, j] : {std::pair{256, 256}, {236, 256}, {270, 250}, {256, 290}}) {
    EXPECT_LT(std::abs(std::complex<double>(before.at(i, j)) * axis -
                       std::complex<double>(rays.at(i, j))),
              0.15)
        << i << ' ' << j;
  }
}

TEST(PlaneField, EveryNodeOnACommonSideBelongsToOneTriangle) {
  const FieldPlan plan = plan_of(10.0, 0.01, 64);
  PlaneField field(plan);
  const auto vertex = [&](int i, int j) {
    PlaneField::Vertex v;
    // Some vertices and sides meet nodes.
    v.place = plan.centre + Eigen::Vector2d(0.02 * (i - 8) + (j % 2) * 0.004, 0.02 * (j - 8));
    v.cosine = {0.0, 0.0};
    v.amplitude = 1.0;
    return PlaneField::corner(plan, v);
  };
  for (int j = 0; j < 16; ++j) {
    for (int i = 0; i < 16; ++i) {
      field.add({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      field.add({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
  }
  field.lay_rest();
  for (int j = 20; j < 44; ++j) {
    for (int i = 20; i < 44; ++i) EXPECT_NEAR(std::abs(field.at(i, j)), 1.0, 1e-3) << i << ' ' << j;
  }
}

TEST(PlaneField, SizesOfTransformsAreSmoothAndEven) {
  EXPECT_EQ(transform_size(1.0), 8);
  EXPECT_EQ(transform_size(97.0), 98);
  EXPECT_EQ(transform_size(101.0), 108);
  EXPECT_EQ(transform_size(1000.5), 1008);
}

}  // namespace
}  // namespace lensforge::plane_field_test
