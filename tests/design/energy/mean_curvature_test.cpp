// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/mean_curvature.h"

#include <gtest/gtest.h>

#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

TEST(MeanCurvature, IsSquaredHalfTraceTimesArea) {
  WeingartenMap m_bar;
  double area_bar = 0.0;
  EXPECT_DOUBLE_EQ(mean_curvature_term({0.2, 0.4, 7.0}, 5.0, 2.0, m_bar, area_bar), 0.09 * 5.0);
}

TEST(MeanCurvature, AdjointEqualsCentralDifferences) {
  Random random(7);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector4d x(random.between(0.1, 1.0), random.between(0.1, 1.0),
                            random.between(-1.0, 1.0), random.between(0.1, 2.0));
    const auto f = [](const Eigen::VectorXd& at) {
      WeingartenMap m_bar;
      double area_bar = 0.0;
      return 0.7 * mean_curvature_term({at[0], at[1], at[2]}, at[3], 0.7, m_bar, area_bar);
    };
    WeingartenMap m_bar;
    double area_bar = 0.0;
    mean_curvature_term({x[0], x[1], x[2]}, x[3], 0.7, m_bar, area_bar);
    const Eigen::Vector4d computed(m_bar.a, m_bar.b, m_bar.c, area_bar);
    EXPECT_LT(testing::plateau_error(computed, f, x, 1e-2), 1e-9);
  }
}

}  // namespace
}  // namespace lensforge
