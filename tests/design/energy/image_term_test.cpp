// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/energy/picture_terms.h"
#include "design/picture_terms.h"

namespace lensforge {
namespace {

using testing::kTermColumns;
using testing::kTermRows;

TEST(ImageTerm, IsTheSumOfSquares) {
  const Eigen::VectorXd error = testing::random_error(kTermColumns * kTermRows, 3);
  EXPECT_NEAR(testing::value_of(&image_term<Executor>, error), error.squaredNorm(), 1e-12);
}

TEST(ImageTerm, AdjointEqualsCentralDifferences) {
  testing::expect_adjoint_equals_central_differences(&image_term<Executor>);
}

TEST(ImageTerm, ThreadCountDoesNotChangeABit) {
  testing::expect_same_bits_for_any_thread_count(&image_term<Executor>);
}

}  // namespace
}  // namespace lensforge
