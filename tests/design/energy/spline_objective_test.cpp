// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/spline_objective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/image/color.h"
#include "core/spline/sample_splines.h"
#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/render.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"
#include "design/spline/made_surface.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::sample_spline;

constexpr int kSamples = 2;

class SplineObjective : public ::testing::Test {
 protected:
  SplineObjective() {
    options_.model = SurfaceModel::kSpline;
    options_.samples = kSamples;
    options_.weights.smooth = 0.0;
    options_.area = {0.01 * mean_, 0.9 * mean_};  // So wide that the barrier acts.
  }

  [[nodiscard]] SplineObjectiveOn<Executor> objective(
      const Executor& executor = Executor::serial()) const {
    return {net_mesh(net_), setup_, target_, options_, executor};
  }

  /// Mean absolute error of a surface's picture, display-encoded.
  [[nodiscard]] double mean_absolute_error(const SampledSurface& nodes) const {
    const Image picture =
        render_surface(nodes.mesh, nodes.normals, setup_, Executor::serial()).image;
    const auto pixels = static_cast<double>(picture.values().size());
    double absolute = 0.0;
    for (std::size_t i = 0; i < picture.values().size(); ++i) {
      const double shown =
          encode(static_cast<double>(picture.values()[i]) / pixels * target_.total());
      absolute += std::fabs(shown - encode(static_cast<double>(target_.values()[i])));
    }
    return absolute / pixels;
  }

  /// Error of a gradient along a direction, against central differences.
  [[nodiscard]] double slope_error(SplineObjectiveOn<Executor>& function,
                                   const Eigen::Matrix3Xd& gradient,
                                   const Eigen::Matrix3Xd& direction) const {
    const testing::Scalar value = [&](const Eigen::VectorXd& x) {
      Eigen::Matrix3Xd ignored(3, net_.points.cols());
      return function.evaluate(x.data(), ignored.data()).energy.total;
    };
    EXPECT_GT(gradient.cwiseProduct(direction).norm(), 0.0);
    return testing::slope_error(value, net_.points.reshaped(), gradient.reshaped(),
                                direction.reshaped());
  }

  ControlNet net_ = sample_spline();
  OpticalSetup setup_ = testing::setup_of({15.0, 10.0}, {24, 16}, 60.0);
  Image target_ = testing::random_picture(24, 16, 0.1, 2);
  double mean_ = 150.0 / (2.0 * kSamples * kSamples * 11.0 * 8.0);
  ObjectiveOptions options_;
};

TEST_F(SplineObjective, PictureIsThatOfTheSplinesOwnNormals) {
  SplineObjectiveOn<Executor> function = objective();
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  const ObjectiveEvaluation e = function.evaluate(net_.points.data(), gradient.data());
  ASSERT_TRUE(e.feasible);
  const SampledSurface nodes = spline_nodes(net_, kSamples);
  EXPECT_NEAR(e.mae, mean_absolute_error(nodes), 1e-6);
  EXPECT_GT(e.mae, 0.01);
}

TEST_F(SplineObjective, GradientEqualsCentralDifferences) {
  SplineObjectiveOn<Executor> function = objective();
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  ASSERT_TRUE(function.evaluate(net_.points.data(), gradient.data()).feasible);
  Random random(3);
  // Heights alone, x and y alone, all of them.
  for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
    Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, gradient.cols());
    for (double& d : direction.middleRows(first, count).reshaped()) d = random.between(-1.0, 1.0);
    direction.array() *= function.movable().array();
    EXPECT_LE(slope_error(function, gradient, direction), 1e-6) << first << ' ' << count;
  }
}

/// Knot cells are 1.3 mm wide: fine ones, whose nodes are MadeNodes, and wide ones (ShiftedNodes).
constexpr MadeBy kMade{0.8, false, 0.8, 0.05, 3.0};
constexpr MadeBy kLittlePolish{0.5, false, 0.35, 0.05, 3.0};

TEST_F(SplineObjective, PictureOfTheMadePartIsThatOfItsSurface) {
  for (const MadeBy& made_by : {kMade, kLittlePolish}) {
    options_.made_by = made_by;
    SplineObjectiveOn<Executor> function = objective();
    function.relinearize(net_.points.data());
    Eigen::Matrix3Xd gradient(3, net_.points.cols());
    const ObjectiveEvaluation made = function.evaluate(net_.points.data(), gradient.data());
    ASSERT_TRUE(made.feasible);
    const SampledSurface nodes = made_nodes(net_, made_by, kSamples, Executor::serial());
    EXPECT_NEAR(made.mae, mean_absolute_error(nodes), 1e-6);
    EXPECT_GT(std::fabs(made.mae - mean_absolute_error(spline_nodes(net_, kSamples))), 1e-4);
  }
}

bool is_folded(const SurfaceMesh& mesh) {
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (mesh.plan_area(t) <= 0.0) return true;
  }
  return false;
}

/// A design for how it is made must not leave a spline that no file can hold.
TEST_F(SplineObjective, FoldsOfTheSplineAreFound) {
  options_.made_by = kMade;
  options_.area = {1e-9 * mean_, 1e-6 * mean_};
  SplineFoldsOn<Executor> folds(net_.shape, setup_.lens_size, Executor::serial());
  const Eigen::Index pushed = 5 * net_.shape.columns + 5;
  int steps = 0;
  for (bool folded = false; !folded && steps < 200; ++steps) {
    net_.points(0, pushed) += 0.02;
    net_.points(0, pushed + 1) -= 0.02;
    folded = is_folded(spline_nodes(net_, kMeshSamples).mesh);
    EXPECT_EQ(folds.any(net_.points.data()), folded) << steps;
  }
  EXPECT_GT(steps, 10);
  EXPECT_LT(steps, 200);
  SplineObjectiveOn<Executor> function = objective();
  function.relinearize(net_.points.data());
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  EXPECT_FALSE(function.evaluate(net_.points.data(), gradient.data()).feasible);
}

TEST_F(SplineObjective, GradientOfTheMadePartEqualsCentralDifferences) {
  for (const MadeBy& made_by : {kMade, kLittlePolish}) {
    options_.made_by = made_by;
    SplineObjectiveOn<Executor> function = objective();
    function.relinearize(net_.points.data());
    Eigen::Matrix3Xd gradient(3, net_.points.cols());
    ASSERT_TRUE(function.evaluate(net_.points.data(), gradient.data()).feasible);
    Random random(4);
    for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}}) {
      Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, gradient.cols());
      for (double& d : direction.middleRows(first, count).reshaped()) d = random.between(-1.0, 1.0);
      direction.array() *= function.movable().array();
      EXPECT_LE(slope_error(function, gradient, direction), 1e-6)
          << made_by.polish_sigma << ' ' << first;
    }
  }
}

/// For the spline itself and for its made surface with narrow and wide knot cells.
TEST_F(SplineObjective, GradientInSeveralColorsEqualsCentralDifferences) {
  setup_.spectrum = {{480.0, 550.0, 620.0}, {}, 12.0};
  for (const std::optional<MadeBy>& made_by :
       {std::optional<MadeBy>(), std::optional(kMade), std::optional(kLittlePolish)}) {
    options_.made_by = made_by;
    SplineObjectiveOn<Executor> function = objective();
    function.relinearize(net_.points.data());
    Eigen::Matrix3Xd gradient(3, net_.points.cols());
    const ObjectiveEvaluation e = function.evaluate(net_.points.data(), gradient.data());
    ASSERT_TRUE(e.feasible);
    const SampledSurface nodes = made_by ? made_nodes(net_, *made_by, kSamples, Executor::serial())
                                         : spline_nodes(net_, kSamples);
    EXPECT_NEAR(e.mae, mean_absolute_error(nodes), 1e-6);
    Random random(5);
    Eigen::Matrix3Xd direction = function.movable();
    for (double& d : direction.reshaped()) d *= random.between(-1.0, 1.0);
    EXPECT_LE(slope_error(function, gradient, direction), 1e-6);
  }
}

TEST_F(SplineObjective, GradientInSeveralColorsOfADiscEqualsCentralDifferences) {
  setup_.spectrum = {{480.0, 550.0, 620.0}, {}, 12.0};
  setup_.outline = circle_outline(setup_.lens_size);
  SplineObjectiveOn<Executor> function = objective();
  function.relinearize(net_.points.data());
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  ASSERT_TRUE(function.evaluate(net_.points.data(), gradient.data()).feasible);
  Random random(5);
  Eigen::Matrix3Xd direction = function.movable();
  for (double& d : direction.reshaped()) d *= random.between(-1.0, 1.0);
  EXPECT_LE(slope_error(function, gradient, direction), 1e-6);
}

TEST_F(SplineObjective, IsTheMeanOverPartsWherePolishVaries) {
  MadeBy varied = kMade;
  varied.polish_spread = 0.2;
  double total = 0.0;
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, net_.points.cols());
  Eigen::Matrix3Xd gradient = sum;
  for (const double sigma : {0.8 * kMade.polish_sigma, 1.2 * kMade.polish_sigma}) {
    options_.made_by = kMade;
    options_.made_by->polish_sigma = sigma;
    SplineObjectiveOn<Executor> part = objective();
    total += part.evaluate(net_.points.data(), gradient.data()).energy.total;
    sum += gradient;
  }
  options_.made_by = varied;
  SplineObjectiveOn<Executor> mean = objective();
  EXPECT_NEAR(mean.evaluate(net_.points.data(), gradient.data()).energy.total, total / 2.0,
              1e-12 * total);
  EXPECT_LE((gradient - sum / 2.0).cwiseAbs().maxCoeff(), 1e-12 * sum.cwiseAbs().maxCoeff());
}

TEST_F(SplineObjective, RimStaysOnTheRectangle) {
  SplineObjectiveOn<Executor> function = objective();
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  ASSERT_TRUE(function.evaluate(net_.points.data(), gradient.data()).feasible);
  int held = 0;
  for (Eigen::Index i = 0; i < gradient.cols(); ++i) {
    for (int k = 0; k < 2; ++k) {
      const double at = net_.points(k, i);
      const bool on_rim = at == 0.0 || at == setup_.lens_size[k];
      EXPECT_EQ(function.movable()(k, i), on_rim ? 0.0 : 1.0);
      if (!on_rim) continue;
      EXPECT_EQ(gradient(k, i), 0.0);
      ++held;
    }
  }
  EXPECT_EQ(held, 2 * (14 + 11));
}

TEST_F(SplineObjective, ThreadCountDoesNotChangeABit) {
  Eigen::Matrix3Xd serial(3, net_.points.cols());
  Eigen::Matrix3Xd parallel = serial;
  SplineObjectiveOn<Executor> one = objective();
  SplineObjectiveOn<Executor> two = objective(Executor::cpu(2));
  EXPECT_EQ(one.evaluate(net_.points.data(), serial.data()).energy.total,
            two.evaluate(net_.points.data(), parallel.data()).energy.total);
  EXPECT_EQ(serial, parallel);
}

TEST_F(SplineObjective, FoldedSplinesAreNotAllowed) {
  SplineObjectiveOn<Executor> function = objective();
  net_.points(0, 14 * 5 + 6) = 1.0;
  Eigen::Matrix3Xd gradient(3, net_.points.cols());
  EXPECT_FALSE(function.evaluate(net_.points.data(), gradient.data()).feasible);
}

}  // namespace
}  // namespace lensforge
