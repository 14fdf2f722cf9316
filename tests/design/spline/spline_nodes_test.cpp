// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/spline_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "core/spline/control_net.h"
#include "core/spline/sample_splines.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge::spline_nodes_test {
namespace {

using testing::Random;
using testing::sample_spline;

constexpr int kSamples = 2;

double dot(const AxisBasis& basis, const std::vector<double>& values,
           const std::vector<double>& coefficients, std::size_t node) {
  double sum = 0.0;
  for (int j = 0; j < basis.taps; ++j) {
    const auto at = static_cast<std::size_t>(basis.taps) * node + static_cast<std::size_t>(j);
    sum += values[at] *
           coefficients[static_cast<std::size_t>(basis.first[node]) + static_cast<std::size_t>(j)];
  }
  return sum;
}

/// Coefficients whose spline is `f` to the fourth power of a knot cell, f(t) with t in mm.
std::vector<double> coefficients_of(const AxisLength& along, const std::function<double(double)>& f,
                                    const std::function<double(double)>& f2) {
  std::vector<double> c;
  c.reserve(static_cast<std::size_t>(along.cells) + 3);
  const double cell = along.length / along.cells;
  for (int i = 0; i < along.cells + 3; ++i) {
    const double t = greville_point(i, along.cells) * cell;
    c.push_back(f(t) - f2(t) * cell * cell / 6.0);
  }
  return c;
}

TEST(AxisBasis, AStraightLineStaysOneToTheRim) {
  const AxisLength along{1, 20, 2.0};
  const AxisBasis basis =
      made_basis(along, even_points(along.cells, kSamples), {0.06, true, 0.13, 0.0, 1.0});
  std::vector<double> line;
  line.reserve(static_cast<std::size_t>(along.cells) + 3);
  for (int i = 0; i < along.cells + 3; ++i) line.push_back(3.0 + greville_point(i, along.cells));
  for (std::size_t k = 0; k < static_cast<std::size_t>(basis.nodes()); ++k) {
    EXPECT_NEAR(dot(basis, basis.value, line, k), 3.0 + 0.5 * static_cast<double>(k), 1e-12);
    EXPECT_NEAR(dot(basis, basis.slope, line, k), 1.0, 1e-6) << k;
  }
}

TEST(AxisBasis, SlopesAreThoseOfTheValues) {
  const AxisLength along{1, 12, 1.0};
  const MadeBy made{0.07, true, 0.11, 0.3, 0.4};
  std::vector<double> c;
  c.reserve(static_cast<std::size_t>(along.cells) + 3);
  for (int i = 0; i < along.cells + 3; ++i) c.push_back(std::sin(2.1 * i));
  constexpr double kStep = 1e-4;
  for (const double t : {0.3, 1.0, 5.5, 11.2}) {
    const AxisBasis b = made_basis(along, {t - kStep, t, t + kStep}, made);
    const double difference =
        (dot(b, b.value, c, 2) + b.lift[2] - dot(b, b.value, c, 0) - b.lift[0]) / (2.0 * kStep);
    EXPECT_NEAR(dot(b, b.slope, c, 1) + b.tilt[1], difference, 1e-3) << t;
  }
}

/// Share of a wave a cos(kt) that remains after balls, one row every `pitch`, averaged with a
/// Gaussian. By brute force: every ball is lowered onto the wave.
double share_left(double wavelength, double pitch, double sigma, double radius) {
  constexpr double kAmplitude = 1e-4;
  constexpr double kFine = 5e-4;
  const double k = 2.0 * std::numbers::pi / wavelength;
  const auto wave = [&](double t) { return kAmplitude * std::cos(k * t); };
  // The length holds whole waves and whole rows.
  const double length = 18.0 * wavelength;
  const auto rows = static_cast<int>(std::lround(length / pitch));
  const double apart = length / rows;
  const int count = static_cast<int>(std::lround(length / kFine));
  std::vector<double> left(static_cast<std::size_t>(count), std::numeric_limits<double>::max());
  for (int row = 0; row < rows; ++row) {
    const double y = row * apart;
    const auto tip = [&](double d) { return wave(y + d) + std::sqrt(radius * radius - d * d); };
    double low = -0.05;
    double high = 0.05;
    for (int i = 0; i < 100; ++i) {  // One maximum: the wave bends less than the ball.
      const double a = low + (high - low) / 3.0;
      const double b = high - (high - low) / 3.0;
      (tip(a) < tip(b) ? low : high) = tip(a) < tip(b) ? a : b;
    }
    const double centre = tip(0.5 * (low + high));
    const int reach = static_cast<int>(2.0 * apart / kFine);
    const int first = static_cast<int>(std::lround(y / kFine));
    for (int i = first - reach; i <= first + reach; ++i) {
      const double d = i * kFine - y;
      double& z = left[static_cast<std::size_t>(((i % count) + count) % count)];
      z = std::min(z, centre - std::sqrt(radius * radius - d * d));
    }
  }
  double sum = 0.0;
  for (int i = 0; i < count; ++i)
    sum += 2.0 * left[static_cast<std::size_t>(i)] * std::cos(k * i * kFine) / count;
  return sum / kAmplitude * std::exp(-0.5 * k * k * sigma * sigma);
}

TEST(AxisBasis, RowsAndPolishTakeAWaveDownAsBallsDo) {
  constexpr double kPitch = 0.05;
  constexpr double kSigma = 0.03;
  for (const double wavelength : {0.4, 0.8}) {
    const double k = 2.0 * std::numbers::pi / wavelength;
    const AxisLength along{1, 640, 8.0};
    const double middle = 320.0;
    const auto wave = [&](double t) { return std::cos(k * (t - 4.0)); };
    const auto bend = [&](double t) { return -k * k * wave(t); };
    const std::vector<double> c = coefficients_of(along, wave, bend);
    const AxisBasis across = made_basis(along, {middle}, {kPitch, true, kSigma, 0.0, 1.0});
    const double left = dot(across, across.value, c, 0);
    EXPECT_NEAR(left, share_left(wavelength, kPitch, kSigma, 0.2), 1.5e-3) << wavelength;
    // Along the rows there is polish alone.
    const AxisBasis by = made_basis(along, {middle}, {kPitch, false, kSigma, 0.0, 1.0});
    EXPECT_NEAR(dot(by, by.value, c, 0), std::exp(-0.5 * k * k * kSigma * kSigma), 1e-4);
    EXPECT_LT(left, dot(by, by.value, c, 0) - 0.005);
  }
}

TEST(AxisBasis, RimIsTakenOffAtBothEnds) {
  const AxisLength along{0, 10, 4.0};
  const AxisBasis basis = made_basis(along, even_points(10, 1), {0.06, true, 0.03, 0.5, 2.0});
  EXPECT_NEAR(basis.lift.front(), -0.5 * (1.0 + std::exp(-2.0)), 1e-12);
  EXPECT_NEAR(basis.lift[5], -0.5 * 2.0 * std::exp(-1.0), 1e-12);
  EXPECT_NEAR(basis.tilt[5], 0.0, 1e-12);
  EXPECT_NEAR(basis.tilt.back(), -basis.tilt.front(), 1e-12);
  EXPECT_GT(basis.tilt.front(), 0.0);
}

TEST(AxisBasis, PlacesInThePlaneAreThoseOfTheSplineItself) {
  const AxisLength along{0, 12, 1.0};
  const std::vector<double> points = even_points(along.cells, 2);
  const AxisBasis made = made_basis(along, points, {0.06, true, 0.13, 0.0, 1.0});
  const AxisBasis plain = plain_basis(along.cells, points);
  for (int k = 0; k < made.nodes(); ++k) {
    std::vector<double> dense(static_cast<std::size_t>(made.coefficients));
    std::vector<double> steep = dense;
    const auto spread = [&](const AxisBasis& basis, double sign) {
      for (int j = 0; j < basis.taps; ++j) {
        const auto at = static_cast<std::size_t>(k) * static_cast<std::size_t>(basis.taps) +
                        static_cast<std::size_t>(j);
        const auto i = static_cast<std::size_t>(basis.first[static_cast<std::size_t>(k)]) +
                       static_cast<std::size_t>(j);
        dense[i] += sign * basis.plan_value[at];
        steep[i] += sign * basis.plan_slope[at];
      }
    };
    spread(made, 1.0);
    spread(plain, -1.0);
    for (std::size_t i = 0; i < dense.size(); ++i) {
      EXPECT_EQ(dense[i], 0.0) << k;
      EXPECT_EQ(steep[i], 0.0) << k;
    }
  }
}

struct Looked {
  Eigen::Matrix3Xd positions;
  Eigen::Matrix3Xd normals;
};

SplineNodesOn<Executor> nodes_of(const ControlNet& net, int samples, const Executor& executor) {
  const Eigen::Vector2i cells = net.cells();
  return {plain_basis(cells.x(), even_points(cells.x(), samples)),
          plain_basis(cells.y(), even_points(cells.y(), samples)), executor};
}

Looked look(SplineNodesOn<Executor>& nodes, const Eigen::Matrix3Xd& points) {
  const Eigen::Index count = Eigen::Index{nodes.shape().columns} * nodes.shape().rows;
  Looked looked{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  nodes.look(points.data(), looked.positions.data(), looked.normals.data());
  return looked;
}

TEST(SplineNodes, AreThoseOfTheControlNet) {
  const ControlNet net = sample_spline();
  for (const int samples : {1, 2, 3}) {
    SplineNodesOn<Executor> nodes = nodes_of(net, samples, Executor::cpu(2));
    const SampledSurface expected = spline_nodes(net, samples);
    ASSERT_EQ(nodes.shape(), expected.mesh.grid);
    const Looked looked = look(nodes, net.points);
    EXPECT_LT((looked.positions - expected.mesh.vertices).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT((looked.normals - expected.normals).cwiseAbs().maxCoeff(), 1e-13);
  }
}

/// Error of the adjoint of a random sum of positions and normals, against central differences.
double adjoint_error(SplineNodesOn<Executor>& nodes, const ControlNet& net) {
  const Looked at = look(nodes, net.points);
  Random random(5);
  Looked weights = at;
  for (double& w : weights.positions.reshaped()) w = random.between(-1.0, 1.0);
  for (double& w : weights.normals.reshaped()) w = random.between(-1.0, 1.0);
  const testing::Scalar weighed = [&](const Eigen::VectorXd& x) {
    const Looked looked = look(nodes, x.reshaped(3, net.points.cols()));
    return looked.positions.cwiseProduct(weights.positions).sum() +
           looked.normals.cwiseProduct(weights.normals).sum();
  };
  Eigen::Matrix3Xd gradient(3, net.points.cols());
  look(nodes, net.points);
  nodes.look_adjoint(weights.positions.data(), weights.normals.data(), gradient.data());
  return testing::plateau_error(gradient.reshaped(), weighed, net.points.reshaped(), 1e-3);
}

TEST(SplineNodes, AdjointEqualsCentralDifferences) {
  const ControlNet net = sample_spline();
  SplineNodesOn<Executor> nodes = nodes_of(net, kSamples, Executor::serial());
  EXPECT_LT(adjoint_error(nodes, net), 1e-9);
}

TEST(SplineNodes, AdjointOfMadeNodesEqualsCentralDifferences) {
  const ControlNet net = sample_spline();
  const Eigen::Vector2i cells = net.cells();
  const MadeBy made{0.6, true, 0.9, 0.2, 1.5};
  const auto basis = [&](int axis) {
    return made_basis({axis, cells[axis], net.points.row(axis).maxCoeff()},
                      even_points(cells[axis], kSamples), made);
  };
  SplineNodesOn<Executor> nodes(basis(0), basis(1), Executor::serial());
  EXPECT_LT(adjoint_error(nodes, net), 1e-9);
}

}  // namespace

}  // namespace lensforge::spline_nodes_test
