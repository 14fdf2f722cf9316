// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "design/energy/objective_kernels.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

constexpr AreaBarrier kBarrier{0.01, 0.05};

TEST(AreaBarrier, IsZeroAboveTheUpperThreshold) {
  for (const double area : {0.05, 0.06, 7.0}) {
    EXPECT_EQ(area_barrier(area, kBarrier).value, 0.0);
    EXPECT_EQ(area_barrier(area, kBarrier).slope, 0.0);
  }
}

TEST(AreaBarrier, IsInfiniteAtAndBelowTheLowerThreshold) {
  for (const double area : {0.01, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(area_barrier(area, kBarrier).value, kInfinity) << area;
  }
}

TEST(AreaBarrier, HasTheValuesOfItsFormula) {
  // (0.04 / (a − 0.01) − 1)²
  EXPECT_NEAR(area_barrier(0.03, kBarrier).value, 1.0, 1e-12);
  EXPECT_NEAR(area_barrier(0.02, kBarrier).value, 9.0, 1e-12);
  EXPECT_NEAR(area_barrier(0.05 - 1e-9, kBarrier).value, 0.0, 1e-12);
}

TEST(AreaBarrier, SlopeEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::VectorXd area = Eigen::VectorXd::Constant(1, random.between(0.013, 0.0499));
    const auto f = [](const Eigen::VectorXd& x) { return area_barrier(x[0], kBarrier).value; };
    const Eigen::VectorXd slope =
        Eigen::VectorXd::Constant(1, area_barrier(area[0], kBarrier).slope);
    EXPECT_LT(testing::plateau_error(slope, f, area, 5e-6), 1e-7);
  }
}

}  // namespace
}  // namespace lensforge
