// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/light_lanes.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

#include "design/finite_difference.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;

Vector3d random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

/// Closed form of the light that returns to its source, for μ = n·ω.
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

/// Directions about `axis`, padded, with their number.
struct Directions {
  explicit Directions(const Vector3d& axis, unsigned seed) {
    std::mt19937 random(seed);
    for (Eigen::Index d = 0; d < kCount; ++d) {
      lanes.row(d) = (axis + 0.9 * random_unit(random)).normalized().transpose();
    }
  }
  static constexpr Eigen::Index kCount = 37;
  LaneVectors<double> lanes = LaneVectors<double>::Zero(padded(kCount), 3);
};

TEST(LightLanes, DirectLightIsThatOfOneDirectionAfterTheOther) {
  const Vector3d n = Vector3d(0.2, -0.3, 0.9).normalized();
  const Directions light(n, 1);
  const Directions sensor(n, 2);
  Eigen::VectorXd lit = Eigen::VectorXd::Ones(padded(Directions::kCount));
  lit[3] = 0.0;
  DirectLanes direct(lit.size());
  reflect_directly(n, light.lanes, sensor.lanes, lit, direct);
  for (Eigen::Index d = 0; d < Directions::kCount; ++d) {
    const Vector3d w_l = light.lanes.row(d);
    const Vector3d w_o = sensor.lanes.row(d);
    EXPECT_NEAR(direct.value[d], lit[d] * reflected(n, w_o, w_l), 1e-13);
    const Vector3d slope = direct.along_light[d] * w_l + direct.along_sensor[d] * w_o;
    EXPECT_LT((slope - lit[d] * reflected_adjoint(n, w_o, w_l)).norm(), 1e-11);
  }
  EXPECT_EQ(direct.value.tail(lit.size() - Directions::kCount).norm(), 0.0);
}

TEST(LightLanes, LossesAddUpToThoseOfOneDirectionAfterTheOther) {
  const Vector3d n = Vector3d::UnitZ();
  const Directions light(n, 3);
  const Directions sensor(n, 4);
  const Eigen::Index count = padded(Directions::kCount);
  DirectLanes direct(count);
  reflect_directly(n, light.lanes, sensor.lanes, Eigen::VectorXd::Ones(count), direct);
  const Eigen::VectorXd indirect = Eigen::VectorXd::LinSpaced(count, 0.0, 0.3);
  LossLanes lanes(count);
  Eigen::VectorXd& weight = lanes.weight;
  weight.setZero();
  weight.head(Directions::kCount).setLinSpaced(0.1, 1.0);
  for (const Loss loss : {Loss::kSquare, Loss::kNegativeSquare, Loss::kInverse}) {
    const LossSums sums = sum_losses(loss, direct, indirect, light.lanes, sensor.lanes, lanes);
    double value = 0.0;
    double curvature = 0.0;
    Vector3d gradient = Vector3d::Zero();
    for (Eigen::Index d = 0; d < Directions::kCount; ++d) {
      const Vector3d slope = reflected_adjoint(n, sensor.lanes.row(d), light.lanes.row(d));
      const double radiance = direct.value[d] + indirect[d];
      value += weight[d] * loss_of(loss, radiance);
      gradient += weight[d] * loss_slope(loss, radiance) * slope;
      curvature += weight[d] * loss_curvature(loss, direct.value[d]) * slope.squaredNorm();
    }
    EXPECT_NEAR(sums.value, value, 1e-12 * std::abs(value));
    EXPECT_LT((sums.gradient - gradient).norm(), 1e-12 * gradient.norm());
    EXPECT_NEAR(sums.curvature, curvature, 1e-12 * curvature);
  }
}

TEST(LightLanes, LightByTwoReflectionsIsTheProductOfBoth) {
  const Vector3d n_k = Vector3d(0.1, 0.2, 1.0).normalized();
  const Vector3d w = Vector3d(0.8, 0.1, 0.5).normalized();
  const Vector3d n_q = Vector3d(-0.7, 0.0, 0.7).normalized();
  const Directions light(n_q + n_k, 5);
  const LaneVectors<float> lanes = light.lanes.cast<float>();
  std::vector<std::uint8_t> lit(static_cast<std::size_t>(lanes.rows()), 3);
  lit[5] = 2;
  Eigen::VectorXf value(lanes.rows());
  Eigen::VectorXf at_most(lanes.rows());
  reflect_twice({n_k.cast<float>(), n_q.cast<float>(), w.cast<float>()}, lanes, lanes, lit.data(),
                value, at_most);
  for (Eigen::Index d = 0; d < Directions::kCount; ++d) {
    const Vector3d w_l = light.lanes.row(d);
    const double product = reflected(n_k, w_l, w) * reflected(n_q, -w, w_l);
    EXPECT_NEAR(value[d], d == 5 ? 0.0 : product, 1e-4 * product + 1e-9) << d;
    EXPECT_GE(at_most[d] * 1.0001F, value[d]);
  }
}

TEST(LightLanes, FlagsSelectWhatCounts) {
  const std::vector<std::uint8_t> flags{0, 1, 2, 3, 0, 1, 2, 3};
  const Eigen::VectorXd value = Eigen::VectorXd::LinSpaced(8, 1.0, 8.0);
  Eigen::VectorXd selected(8);
  select_lanes(flags.data(), 2, value, selected);
  EXPECT_THAT(selected, ::testing::ElementsAre(0.0, 0.0, 3.0, 4.0, 0.0, 0.0, 7.0, 8.0));
}

}  // namespace

}  // namespace lensforge::reflect
