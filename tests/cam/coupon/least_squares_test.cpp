// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "cam/coupon/coupon_fit.h"

namespace lensforge {
namespace {

/// Residuals of a line through points, all of uncertainty `u`.
LeastSquares line_through(const Eigen::VectorXd& x, const Eigen::VectorXd& y, double u) {
  LeastSquares problem;
  problem.free = {0, 1};
  problem.steps = Eigen::Vector2d(1e-4, 1e-4);
  problem.longest = Eigen::Vector2d(10.0, 10.0);
  problem.residuals = [=](const Eigen::VectorXd& p) -> Eigen::VectorXd {
    return ((p[0] + p[1] * x.array() - y.array()) / u).matrix();
  };
  return problem;
}

struct Points {
  Eigen::VectorXd x{8};
  Eigen::VectorXd y{8};
};

Points random_points() {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Points points;
  for (Eigen::Index i = 0; i < points.x.size(); ++i) {
    points.x[i] = static_cast<double>(i);
    points.y[i] = 2.0 - 0.5 * points.x[i] + 0.1 * normal(random);
  }
  return points;
}

TEST(LeastSquares, ALineIsTheTextbooks) {
  const auto [x, y] = random_points();
  const double u = 0.1;
  const LeastSquares problem = line_through(x, y, u);
  const Eigen::VectorXd fit = minimize(problem, Eigen::Vector2d(0.0, 0.0));
  const Eigen::ArrayXd off = x.array() - x.mean();
  const double slope = (off * (y.array() - y.mean())).sum() / off.square().sum();
  EXPECT_NEAR(fit[1], slope, 1e-9);
  EXPECT_NEAR(fit[0], y.mean() - slope * x.mean(), 1e-9);
  const FitQuality quality = fit_quality(problem, fit);
  EXPECT_NEAR(quality.uncertainties[1], u / std::sqrt(off.square().sum()), 1e-9);
  const double n = static_cast<double>(x.size());
  EXPECT_NEAR(quality.uncertainties[0],
              u * std::sqrt(1.0 / n + x.mean() * x.mean() / off.square().sum()), 1e-9);
}

/// What a datum is off the others is what a fit without it says.
TEST(LeastSquares, DeletionIsAFitWithoutTheDatum) {
  const auto [x, y] = random_points();
  const double u = 0.1;
  const LeastSquares problem = line_through(x, y, u);
  const FitQuality quality = fit_quality(problem, minimize(problem, Eigen::Vector2d(0.0, 0.0)));
  for (Eigen::Index left = 0; left < x.size(); ++left) {
    Eigen::MatrixXd matrix(x.size() - 1, 2);
    Eigen::VectorXd values(x.size() - 1);
    for (Eigen::Index i = 0, row = 0; i < x.size(); ++i) {
      if (i == left) continue;
      matrix.row(row) << 1.0, x[i];
      values[row++] = y[i];
    }
    const Eigen::Vector2d others = matrix.colPivHouseholderQr().solve(values);
    const Eigen::Vector2d place(1.0, x[left]);
    const Eigen::Matrix2d covariance = u * u * (matrix.transpose() * matrix).inverse();
    const double spread = std::sqrt(u * u + place.dot(covariance * place));
    EXPECT_NEAR(quality.deletion[left], (others.dot(place) - y[left]) / spread, 1e-6);
  }
}

TEST(LeastSquares, WhatIsNotDeterminedHasNoUsefulUncertainty) {
  Eigen::VectorXd x = Eigen::VectorXd::Constant(4, 2.0);  // One place: no slope.
  const LeastSquares problem = line_through(x, Eigen::Vector4d(1.0, 1.1, 0.9, 1.0), 0.1);
  const FitQuality quality = fit_quality(problem, minimize(problem, Eigen::Vector2d(0.0, 0.0)));
  EXPECT_GT(quality.uncertainties.minCoeff(), 1e3);
}

TEST(LeastSquares, ACurvedValleyIsFollowedToItsEnd) {
  LeastSquares rosenbrock;
  rosenbrock.free = {0, 1};
  rosenbrock.steps = Eigen::Vector2d(1e-5, 1e-5);
  rosenbrock.longest = Eigen::Vector2d(0.5, 0.5);
  rosenbrock.residuals = [](const Eigen::VectorXd& p) -> Eigen::VectorXd {
    return Eigen::Vector2d(10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]);
  };
  const Eigen::VectorXd end = minimize(rosenbrock, Eigen::Vector2d(-1.2, 1.0));
  EXPECT_NEAR(end[0], 1.0, 1e-6);
  EXPECT_NEAR(end[1], 1.0, 1e-6);
}

TEST(LeastSquares, WhatIsHeldKeepsItsValue) {
  const auto [x, y] = random_points();
  LeastSquares problem = line_through(x, y, 0.1);
  problem.free = {0};
  const Eigen::VectorXd fit = minimize(problem, Eigen::Vector2d(0.0, -0.4));
  EXPECT_EQ(fit[1], -0.4);
  EXPECT_NEAR(fit[0], (y + 0.4 * x).mean(), 1e-9);
}

}  // namespace
}  // namespace lensforge
