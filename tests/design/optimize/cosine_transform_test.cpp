// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "design/optimize/grid_preconditioner.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

constexpr int kColumns = 9;
constexpr int kRows = 6;

Eigen::MatrixXd random_nodes(std::uint64_t seed) {
  testing::Random random(seed);
  Eigen::MatrixXd values(kColumns, kRows);
  for (double& v : values.reshaped()) v = random.between(-1.0, 1.0);
  return values;
}

/// The transform of column-major values; a column of the matrix is a row of nodes.
Eigen::MatrixXd transformed(const Eigen::MatrixXd& values) {
  CosineTransform transform(kColumns, kRows);
  Eigen::Map<Eigen::MatrixXd> buffer(transform.values().data(), kColumns, kRows);
  buffer = values;
  transform.run();
  return buffer;
}

/// n × n matrix of the one-dimensional transform: ends count once, all else twice.
Eigen::MatrixXd cosine_matrix(int n) {
  Eigen::MatrixXd matrix(n, n);
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < n; ++i) {
      const double weight = i == 0 || i == n - 1 ? 1.0 : 2.0;
      matrix(k, i) = weight * std::cos(std::numbers::pi * i * k / (n - 1));
    }
  }
  return matrix;
}

/// Negative second difference along a line of nodes, mirrored at its ends.
Eigen::MatrixXd second_difference(int n, double spacing) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    matrix(i, i) = 2.0;
    matrix(i, i == 0 ? 1 : i - 1) -= 1.0;
    matrix(i, i == n - 1 ? n - 2 : i + 1) -= 1.0;
  }
  return matrix / (spacing * spacing);
}

TEST(CosineTransform, EqualsDirectSummation) {
  const Eigen::MatrixXd values = random_nodes(1);
  const Eigen::MatrixXd expected =
      cosine_matrix(kColumns) * values * cosine_matrix(kRows).transpose();
  EXPECT_LT((transformed(values) - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(CosineTransform, TwiceGivesTheValuesBack) {
  const Eigen::MatrixXd values = random_nodes(2);
  const double scale = CosineTransform(kColumns, kRows).inverse_scale();
  EXPECT_DOUBLE_EQ(scale, 1.0 / (4.0 * 8.0 * 5.0));
  EXPECT_LT((scale * transformed(transformed(values)) - values).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(CosineTransform, DiagonalizesSecondDifferences) {
  const Eigen::MatrixXd values = random_nodes(3);
  const Eigen::MatrixXd differences = second_difference(kColumns, 0.5) * values +
                                      values * second_difference(kRows, 2.0).transpose();
  Eigen::MatrixXd expected = transformed(values);
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      expected(c, r) *= CosineTransform::eigenvalue(c, kColumns, 0.5) +
                        CosineTransform::eigenvalue(r, kRows, 2.0);
    }
  }
  EXPECT_LT((transformed(differences) - expected).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(CosineTransform, SolvesPoissonsEquationUpToTheMean) {
  const Eigen::MatrixXd phi = random_nodes(4);
  const Eigen::MatrixXd laplacian =
      -second_difference(kColumns, 1.0) * phi - phi * second_difference(kRows, 1.0).transpose();
  CosineTransform transform(kColumns, kRows);
  Eigen::Map<Eigen::MatrixXd> buffer(transform.values().data(), kColumns, kRows);
  buffer = laplacian.array() + 3.0;  // The mean has no solution and is dropped.
  transform.solve_poisson();
  const Eigen::MatrixXd offset = phi - buffer;
  EXPECT_LT((offset.array() - offset(0, 0)).abs().maxCoeff(), 1e-12);
}

TEST(CosineTransform, EigenvaluesRunFromZeroToFourOverSquaredSpacing) {
  EXPECT_EQ(CosineTransform::eigenvalue(0, 7, 0.5), 0.0);
  EXPECT_DOUBLE_EQ(CosineTransform::eigenvalue(6, 7, 0.5), 16.0);
}

TEST(CosineTransform, TheSmallestGridIsTwoByTwo) {
  CosineTransform transform(2, 2);
  const auto values = transform.values();
  ASSERT_EQ(values.size(), 4U);
  values[0] = 1.0;
  values[1] = values[2] = values[3] = 0.0;
  transform.run();
  for (const double value : values) EXPECT_DOUBLE_EQ(value, 1.0);
}

}  // namespace
}  // namespace lensforge
