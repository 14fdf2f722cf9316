// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/ball_term.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

constexpr int kColumns = 9;
constexpr int kRows = 8;
constexpr double kCellX = 0.04;
constexpr double kCellY = 0.05;

BallNet net_of(const Eigen::Matrix3Xd& points, double sharpest) {
  return {points.data(), kColumns, kRows, kCellX, kCellY, sharpest};
}

/// z = bend · (x cos a + y sin a)² / 2
Eigen::Matrix3Xd trough(double bend, double angle) {
  Eigen::Matrix3Xd points(3, kColumns * kRows);
  for (int v = 0; v < points.cols(); ++v) {
    const double x = v % kColumns * kCellX;
    const double y = v / kColumns * kCellY;
    const double across = x * std::cos(angle) + y * std::sin(angle);
    points.col(v) << x, y, 0.5 * bend * across * across;
  }
  return points;
}

double energy(const Eigen::Matrix3Xd& points, double sharpest) {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, points.cols());
  return ball_term(Executor::serial(), net_of(points, sharpest), 1.0, gradient.data());
}

TEST(BallTerm, CountsValleysSharperThanTheBallAndNoRidges) {
  for (const double angle : {0.0, 0.9, 1.57}) {
    EXPECT_EQ(energy(trough(3.7, angle), 3.75), 0.0);
    EXPECT_EQ(energy(trough(-20.0, angle), 3.75), 0.0);
    EXPECT_GT(energy(trough(4.5, angle), 3.75), 0.0) << angle;
  }
  // Along x: 5 × 4 inner points, each 20 % too sharp in its row; diagonals are less so.
  const double share = kCellX * kCellX / (kCellX * kCellX + kCellY * kCellY);
  EXPECT_LT(1.2 * share, 1.0);
  EXPECT_NEAR(energy(trough(4.5, 0.0), 3.75), 20 * 0.04, 1e-9);
}

TEST(BallTerm, GradientEqualsCentralDifferences) {
  Eigen::Matrix3Xd points = trough(0.0, 0.0);
  testing::Random random(8);
  for (double& z : points.row(2)) z = random.between(-0.004, 0.004);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, points.cols());
  ball_term(Executor::cpu(2), net_of(points, 3.75), 1.0, gradient.data());
  const testing::Scalar value = [](const Eigen::VectorXd& x) {
    return energy(x.reshaped(3, kColumns * kRows), 3.75);
  };
  EXPECT_GT(gradient.norm(), 1.0);
  EXPECT_LT(testing::plateau_error(gradient.reshaped(), value, points.reshaped(), 1e-5), 1e-7);
}

}  // namespace
}  // namespace lensforge
