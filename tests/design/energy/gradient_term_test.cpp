// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "design/energy/picture_terms.h"
#include "design/picture_terms.h"

namespace lensforge {
namespace {

using testing::kTermColumns;
using testing::kTermRows;

TEST(GradientTerm, IsTheSumOfSquaredForwardDifferences) {
  const Eigen::VectorXd error = testing::random_error(kTermColumns * kTermRows, 4);
  const auto rows = error.reshaped(kTermColumns, kTermRows);  // Column-major: a column is a row.
  double expected = 0.0;
  for (int r = 0; r < kTermRows; ++r) {
    for (int c = 0; c < kTermColumns; ++c) {
      if (c + 1 < kTermColumns) expected += std::pow(rows(c + 1, r) - rows(c, r), 2);
      if (r + 1 < kTermRows) expected += std::pow(rows(c, r + 1) - rows(c, r), 2);
    }
  }
  EXPECT_NEAR(testing::value_of(&gradient_term<Executor>, error), expected, 1e-12);
}

TEST(GradientTerm, IgnoresAConstantOffset) {
  const Eigen::VectorXd offset = Eigen::VectorXd::Constant(kTermColumns * kTermRows, 0.7);
  EXPECT_EQ(testing::value_of(&gradient_term<Executor>, offset), 0.0);
}

TEST(GradientTerm, AdjointEqualsCentralDifferences) {
  testing::expect_adjoint_equals_central_differences(&gradient_term<Executor>);
}

TEST(GradientTerm, ThreadCountDoesNotChangeABit) {
  testing::expect_same_bits_for_any_thread_count(&gradient_term<Executor>);
}

}  // namespace
}  // namespace lensforge
