// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "design/finite_difference.h"
#include "design/reflect/light/light_lanes.h"

namespace lensforge::reflect {
namespace {

Eigen::Vector3d random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

/// The closed form of what comes back to the light for μ = n·ω.
double retroreflected(double mu) {
  const double lobe = std::pow(std::max(0.0, 2.0 * mu * mu - 1.0), 30);
  return 0.85 * (0.05 / std::numbers::pi + 0.95 * 32.0 / (2.0 * std::numbers::pi) * lobe) * mu;
}

TEST(Phong, RetroreflectionDependsOnTheCosineAlone) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d n = random_unit(random);
    const Eigen::Vector3d w = (n + 0.8 * random_unit(random)).normalized();
    EXPECT_NEAR(reflected(n, w, w), retroreflected(n.dot(w)), 1e-13);
  }
}

TEST(Phong, StraightBackIsTheKnownRadiance) {
  const Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(reflected(n, n, n), 4.12609, 5e-6);
}

TEST(Phong, IsTheSameBothWaysButForTheCosine) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d n = random_unit(random);
    const Eigen::Vector3d a = (n + 0.7 * random_unit(random)).normalized();
    const Eigen::Vector3d b = (n + 0.7 * random_unit(random)).normalized();
    EXPECT_NEAR(reflected(n, a, b) * n.dot(a), reflected(n, b, a) * n.dot(b), 1e-12);
  }
}

TEST(Phong, AdjointMatchesFiniteDifferences) {
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = random_unit(random);
    const Eigen::Vector3d w_o = (n + 0.5 * random_unit(random)).normalized();
    const Eigen::Vector3d mirror = 2.0 * n.dot(w_o) * n - w_o;
    const Eigen::Vector3d w_i = (mirror + 0.3 * random_unit(random)).normalized();
    if (n.dot(w_i) < 0.05) continue;
    const auto value = [&](const Eigen::VectorXd& x) { return reflected(x, w_o, w_i); };
    EXPECT_LT(testing::plateau_error(reflected_adjoint(n, w_o, w_i), value, n, 1e-4), 1e-6);
  }
}

}  // namespace
}  // namespace lensforge::reflect
