// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "design/optimize/grid_preconditioner.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

constexpr GridShape kShape{40, 23};
constexpr int kVertices = kShape.columns * kShape.rows;

TEST(Levelling, LeavesEvenCurvatureAlone) {
  const Eigen::ArrayXd factors =
      levelling_factors(Eigen::VectorXd::Constant(kVertices, 7.3), kShape);
  EXPECT_LT((factors - 1.0).abs().maxCoeff(), 1e-12);
}

/// Curvature goes with the square of reach: halves of 4 and 1 (squares 16 and 1) want 1 : 2.
TEST(Levelling, EvensOutTwoHalves) {
  Eigen::VectorXd squares = Eigen::VectorXd::Ones(kVertices);
  for (int v = 0; v < kVertices; ++v) {
    if (v % kShape.columns < kShape.columns / 2) squares[v] = 16.0;
  }
  const Eigen::ArrayXd factors = levelling_factors(squares, kShape);
  const double left = factors[0];
  const double right = factors[kVertices - 1];
  EXPECT_NEAR(right / left, 2.0, 1e-12);
  EXPECT_LT(left, 1.0);
  EXPECT_GT(right, 1.0);
}

TEST(Levelling, FollowsMeansOverTheNeighbourhood) {
  testing::Random random(3);
  Eigen::VectorXd squares(kVertices);
  for (double& square : squares) square = random.between(0.5, 2.0);
  Eigen::ArrayXd wanted(kVertices);
  for (int r = 0; r < kShape.rows; ++r) {
    for (int c = 0; c < kShape.columns; ++c) {
      double sum = 0.0;
      int count = 0;
      for (int v = 0; v < kVertices; ++v) {
        const int far =
            std::max(std::abs(v % kShape.columns - c), std::abs(v / kShape.columns - r));
        if (far > kLevellingRadius) continue;
        sum += squares[v];
        ++count;
      }
      wanted[r * kShape.columns + c] = -0.25 * std::log(sum / count);
    }
  }
  const Eigen::ArrayXd expected = (wanted - wanted.mean()).exp();
  EXPECT_LT((levelling_factors(squares, kShape) - expected).abs().maxCoeff(), 1e-12);
}

TEST(Levelling, StaysWithinItsBoundWhereNothingIsFelt) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(kVertices);
  squares.head(10 * kShape.columns).setConstant(1e9);
  const Eigen::ArrayXd factors = levelling_factors(squares, kShape);
  EXPECT_DOUBLE_EQ(factors.maxCoeff(), kMaxLevelling);
  EXPECT_DOUBLE_EQ(factors.minCoeff(), 1.0 / kMaxLevelling);
}

}  // namespace
}  // namespace lensforge
