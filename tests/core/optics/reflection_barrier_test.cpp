// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/optics/refraction.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

TEST(ReflectionBarrier, IsTheInverseSquareCosineOfTheRefractedAngle) {
  for (const double incidence : {0.0, 0.2, 0.5, 0.7}) {
    const double refracted = std::asin(1.49 * std::sin(incidence));
    EXPECT_NEAR(reflection_barrier(std::cos(incidence), 1.49).value,
                1.0 / std::pow(std::cos(refracted), 2), 1e-12);
  }
}

TEST(ReflectionBarrier, IsInfiniteBeyondTheCriticalAngle) {
  const double critical = std::asin(1.0 / 1.49);
  EXPECT_TRUE(std::isfinite(reflection_barrier(std::cos(critical - 1e-9), 1.49).value));
  EXPECT_EQ(reflection_barrier(std::cos(critical + 1e-9), 1.49).value, kInfinity);
  EXPECT_EQ(reflection_barrier(-1.0, 1.49).value, kInfinity);
  EXPECT_EQ(reflection_barrier(std::numeric_limits<double>::quiet_NaN(), 1.49).value, kInfinity);
}

TEST(ReflectionBarrier, SlopeEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double eta = random.between(1.1, 2.0);
    const double least = std::cos(0.9 * std::asin(1.0 / eta));
    const Eigen::VectorXd c = Eigen::VectorXd::Constant(1, random.between(least, 1.0));
    const auto f = [&](const Eigen::VectorXd& x) { return reflection_barrier(x[0], eta).value; };
    const Eigen::VectorXd slope = Eigen::VectorXd::Constant(1, reflection_barrier(c[0], eta).slope);
    EXPECT_LT(testing::plateau_error(slope, f, c, 1e-4), 1e-7);
  }
}

}  // namespace
}  // namespace lensforge
