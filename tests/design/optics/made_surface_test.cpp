// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/made_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/spline/cubic_spline.h"

namespace lensforge {
namespace {

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

/// The spline's height at a place, turned about the rim beyond it.
double height_at(const ControlNet& net, double x, double y) {
  const double rim_x = std::clamp(x, 0.0, kWidth);
  const double rim_y = std::clamp(y, 0.0, kHeight);
  if (rim_x != x) return 2.0 * height_at(net, rim_x, y) - height_at(net, 2.0 * rim_x - x, y);
  if (rim_y != y) return 2.0 * height_at(net, x, rim_y) - height_at(net, x, 2.0 * rim_y - y);
  const Eigen::Vector2d start(30.0 * x / kWidth, 20.0 * y / kHeight);
  return net.at(net.parameters_of({x, y}, start)).point.z();
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
    EXPECT_NEAR(made.at(at).z, average_at(net, at, sigma), 1e-7) << at.transpose();
    constexpr double kStep = 1e-3;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
      if (!(at - step).cwiseMax(0.0).isApprox(at - step) || at[k] + kStep > 1.0) continue;
      const double slope =
          (average_at(net, at + step, sigma) - average_at(net, at - step, sigma)) / (2.0 * kStep);
      EXPECT_NEAR(made.at(at).slope[k], slope, 1e-6) << at.transpose() << ' ' << k;
    }
  }
}

TEST(MadeSurface, LeavesAPlaneAsItIs) {
  ControlNet net = warped_net();
  net.points.row(2) = 0.2 * net.points.row(0) - 0.1 * net.points.row(1);
  const MadeSurface made(net, kMade, Executor::serial());
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.7, 0.4), {0.0, 0.0}, {1.5, 1.0}}) {
    EXPECT_NEAR(made.at(at).z, 0.2 * at.x() - 0.1 * at.y(), 1e-9);
    EXPECT_NEAR(made.at(at).slope.x(), 0.2, 1e-9);
    EXPECT_NEAR(made.at(at).slope.y(), -0.1, 1e-9);
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

}  // namespace
}  // namespace lensforge
