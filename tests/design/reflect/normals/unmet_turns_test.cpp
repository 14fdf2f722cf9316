// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "design/reflect/shape/normals.h"

namespace lensforge::reflect {
namespace {

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

Eigen::Vector3d turned(double angle) { return {std::sin(angle), 0.0, std::cos(angle)}; }

TEST(UnmetTurns, TargetsThatAreReachedStayAsTheyAre) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  unmet.record(kUp, kUp);
  EXPECT_EQ(unmet.added_to(kUp), kUp);
}

TEST(UnmetTurns, SumOfWhatIsMissingIsAdded) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  const Eigen::Vector3d target = turned(0.1);
  for (int i = 0; i < 3; ++i) unmet.record(target, kUp);
  const Eigen::Vector3d expected = (target + 3.0 * kUnmetStep * (target - kUp)).normalized();
  EXPECT_LT((unmet.added_to(target) - expected).norm(), 1e-14);
}

TEST(UnmetTurns, FacesThatNeverTurnAreNotAskedForMoreThanTheLargestSum) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  const Eigen::Vector3d target = turned(0.4);
  for (int i = 0; i < 1000; ++i) unmet.record(target, kUp);
  const Eigen::Vector3d missing = (target - kUp).normalized();
  const Eigen::Vector3d expected = (target + kLargestUnmetTurn * missing).normalized();
  EXPECT_LT((unmet.added_to(target) - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace lensforge::reflect
