// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/made_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/lens/continued_surface.h"
#include "core/spline/control_net.h"
#include "core/spline/sample_splines.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

constexpr double kWidth = 1.5;
constexpr double kHeight = 1.0;
constexpr MadeBy kMade{0.045, true, 0.03, 0.0, 1.0};

/// A spline of bumps above knots that are up to 1.5 times as dense here as there.
ControlNet warped_net() {
  ControlNet net{{33, 23}, Eigen::Matrix3Xd(3, 33 * 23)};
  const auto warped = [](double t, double s) {
    return t + 0.03 * std::sin(2.0 * std::numbers::pi * t) * (1.0 + s);
  };
  for (int j = 0; j < 23; ++j) {
    for (int i = 0; i < 33; ++i) {
      const double u = greville_point(i, 30) / 30;
      const double v = greville_point(j, 20) / 20;
      const double x = kWidth * warped(u, v * (1.0 - v));
      const double y = kHeight * warped(v, u * (1.0 - u));
      net.points.col(j * 33 + i) << x, y, 5.0 + 1e-3 * std::sin(15.0 * x) * std::cos(12.0 * y);
    }
  }
  return net;
}

/// Waves over knots that are 90 µm apart on the left and 10 µm, a third of σ, on the right.
ControlNet squeezed_net() {
  ControlNet net = warped_net();
  for (int j = 0; j < 23; ++j) {
    for (int i = 0; i < 33; ++i) {
      const double t = greville_point(i, 30) / 30;
      auto point = net.points.col(j * 33 + i);
      point.x() = kWidth * (t + 0.8 / std::numbers::pi * std::sin(std::numbers::pi * t));
      point.z() = 5.0 + 2e-5 * std::cos(0.8 * i + 0.3 * j);
    }
  }
  return net;
}

/// The spline's height at a place, beyond the rim as it is cut there (continued_surface()):
/// derivatives are the spline's own, at a corner differences of its continuation.
double height_at(const ControlNet& net, double x, double y) {
  const double rim_x = std::clamp(x, 0.0, kWidth);
  const double rim_y = std::clamp(y, 0.0, kHeight);
  const double height = RunOut{}.height(std::abs(x - rim_x) + std::abs(y - rim_y));
  if (rim_x != x && rim_y != y) {
    constexpr double kStep = 1e-3;
    const double inwards = y > rim_y ? -kStep : kStep;
    const double z = height_at(net, x, rim_y);
    const double z1 = height_at(net, x, rim_y + inwards);
    const double z2 = height_at(net, x, rim_y + 2.0 * inwards);
    const double slope = (-1.5 * z + 2.0 * z1 - 0.5 * z2) / inwards;
    const double bend = (z - 2.0 * z1 + z2) / (inwards * inwards);
    return z + (y - rim_y) * slope + RunOut{}.height(std::abs(y - rim_y)) * bend;
  }
  const Eigen::Vector2d start(30.0 * rim_x / kWidth, 20.0 * rim_y / kHeight);
  const SurfaceShape shape = net.at(net.parameters_of({rim_x, rim_y}, start)).shape();
  const int axis = rim_x != x ? 0 : 1;
  const double beyond = axis == 0 ? x - rim_x : y - rim_y;
  return shape.z + beyond * shape.slope[axis] + height * shape.bend(axis, axis);
}

/// The average with a Gaussian as a sum over a fine grid of its own.
double average_at(const ControlNet& net, const Eigen::Vector2d& at, const Eigen::Vector2d& sigma) {
  constexpr int kHalf = 30;
  constexpr double kStep = 0.2;  // In σ.
  double sum = 0.0;
  double weights = 0.0;
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const double weight = std::exp(-0.5 * kStep * kStep * (i * i + j * j));
      const Eigen::Vector2d apart = kStep * sigma.cwiseProduct(Eigen::Vector2d(i, j));
      sum += weight * height_at(net, at.x() + apart.x(), at.y() + apart.y());
      weights += weight;
    }
  }
  return sum / weights;
}

TEST(MadeSurface, IsTheAverageOfTheSpline) {
  const ControlNet net = warped_net();
  const MadeSurface made(net, kMade, Executor::cpu(2));
  const Eigen::Vector2d sigma(0.03, std::hypot(0.03, 0.045 / std::sqrt(12.0)));
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(0.7, 0.4), {0.31, 0.77}, {0.02, 0.5}, {1.5, 0.01}}) {
    // The third derivative jumps at the rim.
    const bool rim = at.minCoeff() < 0.1;
    EXPECT_NEAR(made.at(at).z, average_at(net, at, sigma), 1e-7) << at.transpose();
    constexpr double kStep = 1e-3;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
      if (!(at - step).cwiseMax(0.0).isApprox(at - step) || at[k] + kStep > 1.0) continue;
      const double slope =
          (average_at(net, at + step, sigma) - average_at(net, at - step, sigma)) / (2.0 * kStep);
      EXPECT_NEAR(made.at(at).slope[k], slope, rim ? 3e-6 : 1e-6) << at.transpose() << ' ' << k;
    }
  }
}

TEST(MadeSurface, GoesOnAsItIsCutWhereKnotsAreSqueezed) {
  const ControlNet net = squeezed_net();
  const MadeSurface made(net, kMade, Executor::cpu(2));
  const Eigen::Vector2d sigma(0.03, std::hypot(0.03, 0.045 / std::sqrt(12.0)));
  constexpr double kStep = 1e-3;
  for (const double y : {0.3, 0.55, 0.7}) {
    const Eigen::Vector2d at(kWidth, y);
    const Eigen::Vector2d step(kStep, 0.0);
    // With derivatives from samples 0.75 σ apart it is 1e-4 mm and 6e-3 off.
    EXPECT_NEAR(made.at(at).z, average_at(net, at, sigma), 2e-6);
    const double slope =
        (average_at(net, at + step, sigma) - average_at(net, at - step, sigma)) / (2.0 * kStep);
    EXPECT_NEAR(made.at(at).slope.x(), slope, 5e-5);
  }
}

/// A spline with the heights f(x, y) to the fourth power of its knot cells.
ControlNet even_net(const GridShape& shape, const Eigen::Vector2d& size,
                    const std::function<double(double, double)>& height) {
  ControlNet net{shape, Eigen::Matrix3Xd(3, Eigen::Index{shape.columns} * shape.rows)};
  const Eigen::Vector2d cells = net.cells().cast<double>();
  const Eigen::Vector2d cell = size.cwiseQuotient(cells);
  for (int j = 0; j < shape.rows; ++j) {
    for (int i = 0; i < shape.columns; ++i) {
      const double x = cell.x() * greville_point(i, net.cells().x());
      const double y = cell.y() * greville_point(j, net.cells().y());
      // A uniform cubic spline of the coefficients c has the values c + h² c″ / 6 at its knots.
      const auto bend = [&](double dx, double dy) {
        return height(x + dx, y + dy) - 2.0 * height(x, y) + height(x - dx, y - dy);
      };
      net.points.col(j * shape.columns + i) << x, y,
          height(x, y) - (bend(cell.x(), 0.0) + bend(0.0, cell.y())) / 6.0;
    }
  }
  return net;
}

/// What the part keeps of a wave far from its rim, by the closed form: the rows' share, p²/24 f″
/// across them, is in the smoothed part alone.
TEST(MadeSurface, AWaveFadesAsTheTransferFunctionSays) {
  constexpr double kPitch = 0.045;
  const Eigen::Vector2d size(3.0, 2.4);
  for (const int order : {2, 4}) {
    for (const double floor : {0.0, 0.15}) {
      for (const Eigen::Vector2d& k :
           {Eigen::Vector2d(5.0, 0.0), {12.0, 9.0}, {0.0, 30.0}, {25.0, -25.0}, {33.0, 10.0}}) {
        const MadeBy made{kPitch, true, 0.03, 0.0, 1.0, 0.0, order, floor};
        const auto wave = [&](double x, double y) {
          return 1e-3 * std::sin(k.x() * x + k.y() * y + 0.3);
        };
        const ControlNet net = even_net({603, 483}, size, wave);
        const MadeSurface surface(net, made, Executor::cpu(2));
        const double t = std::pow(0.03 * k.norm() / std::numbers::sqrt2, order);
        const double rows = std::exp(-kPitch * kPitch * k.y() * k.y() / 24.0);
        const double left = floor + (1.0 - floor) * rows * std::exp(-t);
        for (const Eigen::Vector2d& at : {Eigen::Vector2d(1.51, 1.23), {1.2, 0.97}}) {
          const double phase = k.dot(at) + 0.3;
          const SurfacePoint point = surface.at(at);
          EXPECT_NEAR(point.z, left * 1e-3 * std::sin(phase), 1e-7)
              << order << ' ' << k.transpose();
          const Eigen::Vector2d slope = left * 1e-3 * std::cos(phase) * k;
          EXPECT_LT((point.slope - slope).norm(), 1e-7 * k.norm()) << order << ' ' << k.transpose();
        }
      }
    }
  }
}

TEST(MadeSurface, LeavesAPlaneAsItIs) {
  ControlNet net = warped_net();
  net.points.row(2) = 0.2 * net.points.row(0) - 0.1 * net.points.row(1);
  MadeBy film = kMade;
  film.polish_order = 4;
  film.polish_floor = 0.1;
  for (const MadeBy& by : {kMade, film}) {
    const MadeSurface made(net, by, Executor::serial());
    for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.7, 0.4), {0.0, 0.0}, {1.5, 1.0}}) {
      EXPECT_NEAR(made.at(at).z, 0.2 * at.x() - 0.1 * at.y(), 1e-9);
      EXPECT_NEAR(made.at(at).slope.x(), 0.2, 1e-9);
      EXPECT_NEAR(made.at(at).slope.y(), -0.1, 1e-9);
    }
  }
}

TEST(MadeSurface, RowsAlongYTurnTheGaussian) {
  ControlNet net = warped_net();
  ControlNet turned{{23, 33}, Eigen::Matrix3Xd(3, 33 * 23)};
  for (int j = 0; j < 23; ++j) {
    for (int i = 0; i < 33; ++i) {
      const Eigen::Vector3d p = net.points.col(j * 33 + i);
      turned.points.col(i * 23 + j) << p.y(), p.x(), p.z();
    }
  }
  MadeBy along_y = kMade;
  along_y.rows_along_x = false;
  const SurfacePoint a = MadeSurface(net, kMade, Executor::serial()).at({0.7, 0.4});
  const SurfacePoint b = MadeSurface(turned, along_y, Executor::serial()).at({0.4, 0.7});
  EXPECT_NEAR(a.z, b.z, 1e-12);
  EXPECT_NEAR(a.slope.x(), b.slope.y(), 1e-10);
}

TEST(MadeSurface, OfACastPartHasTheRowsOfItsMould) {
  // A mould is the negative, 1 / (1 − shrinkage) as large; its rows are p apart.
  const MadeBy cast = kMade.cast(0.1);
  EXPECT_DOUBLE_EQ(cast.pitch, 0.9 * kMade.pitch);
  MadeBy rest = cast;
  rest.pitch = kMade.pitch;
  EXPECT_EQ(rest, kMade);
  const ControlNet net = warped_net();
  ControlNet turned = net;
  turned.points.row(2) *= -1.0;
  const SurfacePoint part = MadeSurface(net, kMade, Executor::serial()).at({0.7, 0.4});
  const SurfacePoint mould = MadeSurface(turned, kMade, Executor::serial()).at({0.7, 0.4});
  EXPECT_NEAR(part.z, -mould.z, 1e-12);
}

TEST(MadeSurface, NodesStayWhereTheyAreInThePlane) {
  const ControlNet net = warped_net();
  const SampledSurface made = made_nodes(net, kMade, 2, Executor::cpu(2));
  const SampledSurface plain = spline_nodes(net, 2);
  EXPECT_EQ(made.mesh.vertices.topRows<2>(), plain.mesh.vertices.topRows<2>());
  EXPECT_EQ(made.mesh.vertices, made_nodes(net, kMade, 2, Executor::serial()).mesh.vertices);
  EXPECT_GT((made.mesh.vertices.row(2) - plain.mesh.vertices.row(2)).cwiseAbs().maxCoeff(), 1e-5);
}

constexpr int kSamples = 2;
/// Its grid has 25 × 17 cells, so no node is where its average changes samples: there it steps by
/// 1e-8.
constexpr MadeBy kCoarse{0.8, false, 0.8, 0.05, 3.0};

/// Result of look(), as one vector: positions, then slopes.
struct Looked {
  Eigen::Matrix3Xd positions;
  Eigen::Matrix3Xd normals;
};

template <class Nodes>
Looked looked(Nodes& nodes, const Eigen::Matrix3Xd& points) {
  const Eigen::Index count = Eigen::Index{nodes.shape().columns} * nodes.shape().rows;
  Looked result{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  nodes.look(points.data(), result.positions.data(), result.normals.data());
  return result;
}

MadeNodes nodes_of(const ControlNet& net, const Executor& executor = Executor::serial(),
                   const MadeBy& made = kCoarse) {
  return {net.shape, {15.0, 10.0}, kSamples, made, executor};
}

/// A Gaussian, a film, and both with a floor.
std::vector<MadeBy> polishes() {
  std::vector<MadeBy> all(4, kCoarse);
  all[1].polish_order = all[3].polish_order = 4;
  all[2].polish_floor = all[3].polish_floor = 0.2;
  return all;
}

TEST(MadeNodes, AreTheMadeSurfaceAboveTheNodes) {
  const ControlNet net = testing::sample_spline();
  for (const MadeBy& made : polishes()) {
    MadeNodes nodes = nodes_of(net, Executor::serial(), made);
    const SampledSurface expected = made_nodes(net, made, kSamples, Executor::serial());
    for (int call = 0; call < 2; ++call) {  // The second one knows where samples lie.
      const Looked found = looked(nodes, net.points);
      EXPECT_LE((found.positions - expected.mesh.vertices).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LE((found.normals - expected.normals).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

/// Checks the adjoint of a random sum of heights and slopes against central differences.
template <class Nodes>
void expect_adjoint(Nodes& nodes, const ControlNet& net, bool made_normals) {
  Looked bar = looked(nodes, net.points);
  Random random(5);
  for (double& b : bar.positions.reshaped()) b = random.between(-1.0, 1.0);
  for (double& b : bar.normals.topRows(2).reshaped()) b = random.between(-1.0, 1.0);
  if (made_normals) bar.normals.row(2).setZero();  // Normals are (−slope, 1).
  Eigen::Matrix3Xd gradient(3, net.points.cols());
  Eigen::Matrix3Xd normal_bar = bar.normals;  // ShiftedNodes changes it.
  nodes.look_adjoint(bar.positions.data(), normal_bar.data(), gradient.data());
  const testing::Scalar value = [&](const Eigen::VectorXd& x) {
    const Looked at = looked(nodes, x.reshaped(3, net.points.cols()));
    return at.positions.cwiseProduct(bar.positions).sum() +
           at.normals.cwiseProduct(bar.normals).sum();
  };
  for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
    Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, net.points.cols());
    for (int j = 0; j < net.shape.rows; ++j) {
      for (int i = 0; i < net.shape.columns; ++i) {
        Eigen::Vector3d d = random.vector3();
        if (i == 0 || i + 1 == net.shape.columns) d.x() = 0.0;
        if (j == 0 || j + 1 == net.shape.rows) d.y() = 0.0;
        direction.col(j * net.shape.columns + i).segment(first, count) = d.segment(first, count);
      }
    }
    const double expected = gradient.cwiseProduct(direction).sum();
    std::vector<double> errors;
    for (const double step : {1e-2, 1e-3, 1e-4}) {
      errors.push_back(std::fabs(
          testing::directional_slope(value, net.points.reshaped(), direction.reshaped(), step) /
              expected -
          1.0));
    }
    EXPECT_LE(testing::plateau_error(errors), 1e-5) << first << ' ' << count;
  }
}

TEST(MadeNodes, AdjointEqualsCentralDifferences) {
  const ControlNet net = testing::sample_spline();
  for (const MadeBy& made : polishes()) {
    MadeNodes nodes = nodes_of(net, Executor::serial(), made);
    expect_adjoint(nodes, net, true);
  }
}

TEST(ShiftedNodes, AdjointEqualsCentralDifferences) {
  const ControlNet net = testing::sample_spline();
  for (MadeBy made : polishes()) {
    made.polish_sigma = 0.3;
    ShiftedNodes nodes(net.shape, {15.0, 10.0}, kSamples, made, Executor::serial());
    nodes.measure(net.points.data());
    expect_adjoint(nodes, net, false);
  }
}

/// Of even knots the terms are the made surface itself: without a measured shift nodes agree with
/// it away from the rim.
TEST(ShiftedNodes, OfEvenKnotsAreTheMadeSurface) {
  const Eigen::Vector2d size(6.0, 4.5);
  const ControlNet net = even_net({43, 33}, size, [](double x, double y) {
    return 1e-3 * (std::sin(5.0 * x + 4.0 * y) + std::cos(9.0 * x) * std::sin(8.0 * y));
  });
  for (MadeBy made : polishes()) {
    made.pitch = 0.06;
    made.polish_sigma = 0.05;
    made.rim_depth = 0.0;
    ShiftedNodes nodes(net.shape, size, kSamples, made, Executor::serial());
    const Looked found = looked(nodes, net.points);
    const SampledSurface expected = made_nodes(net, made, kSamples, Executor::cpu(2));
    for (Eigen::Index n = 0; n < found.positions.cols(); ++n) {
      const Eigen::Vector2d at = found.positions.col(n).head<2>();
      if (at.minCoeff() < 1.0 || (size - at).minCoeff() < 1.0) continue;
      EXPECT_NEAR(found.positions(2, n), expected.mesh.vertices(2, n), 2e-7);
      const Eigen::Vector2d slope = -found.normals.col(n).head<2>() / found.normals(2, n);
      EXPECT_LT((slope + expected.normals.col(n).head<2>()).norm(), 2e-6);
    }
  }
}

TEST(MadeNodes, ThreadCountDoesNotChangeABit) {
  const ControlNet net = testing::sample_spline();
  MadeNodes one = nodes_of(net, Executor::serial(), polishes().back());
  MadeNodes two = nodes_of(net, Executor::cpu(2), polishes().back());
  const Looked a = looked(one, net.points);
  const Looked b = looked(two, net.points);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.normals, b.normals);
  Eigen::Matrix3Xd by_one(3, net.points.cols());
  Eigen::Matrix3Xd by_two = by_one;
  one.look_adjoint(a.positions.data(), a.normals.data(), by_one.data());
  two.look_adjoint(a.positions.data(), a.normals.data(), by_two.data());
  EXPECT_EQ(by_one, by_two);
}

}  // namespace

}  // namespace lensforge
