// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/two_face_objective.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/image/color.h"
#include "core/spline/sample_splines.h"
#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/render.h"
#include "design/schedule/levels.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::sample_spline;

constexpr int kFaceSamples = 2;
constexpr GridShape kFront{9, 7};

/// A lens of 15 × 10 mm before a near screen and a far, tilted one.
class TwoFaces : public ::testing::Test {
 protected:
  TwoFaces() {
    options_.model = SurfaceModel::kSpline;
    options_.samples = kFaceSamples;
    options_.weights.smooth = 0.0;
    options_.weights.barrier = 1e-2;
    options_.area = {0.01 * mean_, 0.9 * mean_};  // So wide that the barrier acts.
    near_ = {testing::setup_of({15.0, 10.0}, {24, 16}, 60.0),
             testing::random_picture(24, 16, 0.1, 2)};
    far_ = {testing::setup_of({15.0, 10.0}, {18, 14}, 140.0),
            testing::random_picture(18, 14, 0.1, 5)};
    far_.setup.image_size = {22.0, 16.0};
    far_.setup.image_origin = {-3.0, -2.0};
    far_.setup.screen_x = Eigen::Vector3d(0.96, 0.0, 0.28);
    faces_.exit = sample_spline().points;
    faces_.front.resize(kFront.columns, kFront.rows);
    Random random(7);
    for (double& h : faces_.front.reshaped()) h = random.between(-0.03, 0.005);
  }

  void light_by(const Lamp& lamp) {
    near_.setup.lamp = lamp;
    far_.setup.lamp = lamp;
  }

  [[nodiscard]] TwoFaceObjective objective(const Executor& executor = Executor::serial()) const {
    // The thickness is above some nodes, so that its penalty acts.
    return {sample_spline().shape,    kFront,  {near_, far_}, options_,
            {5.0, 1.0, unfolded_to_}, executor};
  }

  /// Error of the gradient along random directions of one face, against central differences.
  void expect_slopes(bool front) {
    TwoFaceObjective function = objective();
    LensFaces gradient;
    ASSERT_TRUE(function.evaluate(faces_, gradient).feasible);
    Random random(3);
    const auto values_of = [&](LensFaces& faces) {
      double* const first = front ? faces.front.data() : faces.exit.data();
      return Eigen::Map<Eigen::VectorXd>(first, front ? faces.front.size() : faces.exit.size());
    };
    const Eigen::VectorXd start = values_of(faces_);
    const Eigen::VectorXd computed = values_of(gradient);
    Eigen::VectorXd direction(start.size());
    for (double& d : direction) d = random.between(-1.0, 1.0);
    const testing::Scalar value = [&](const Eigen::VectorXd& x) {
      LensFaces moved = faces_;
      values_of(moved) = x;
      LensFaces ignored;
      return function.evaluate(moved, ignored).energy.total;
    };
    EXPECT_LE(testing::slope_error(value, start, computed, direction), 1e-6) << front;
  }

  double unfolded_to_ = 8.0;
  ScreenGoal near_;
  ScreenGoal far_;
  LensFaces faces_;
  double mean_ = 150.0 / (2.0 * kFaceSamples * kFaceSamples * 11.0 * 8.0);
  ObjectiveOptions options_;
};

TEST_F(TwoFaces, GradientsEqualCentralDifferencesForEveryLamp) {
  const Lamp lamps[] = {ParallelLight{}, ParallelLight{{0.1, -0.2, std::sqrt(0.95)}},
                        PointSource{{6.0, 4.0, -50.0}, Emission::kIsotropic},
                        PointSource{{9.0, 2.0, -40.0}, Emission::kLambertian}};
  for (const Lamp& lamp : lamps) {
    light_by(lamp);
    for (const bool front : {true, false}) expect_slopes(front);
  }
}

TEST_F(TwoFaces, LightThatGathersBelowTheHeightGivenIsPenalised) {
  LensFaces ignored;
  const double low = objective().evaluate(faces_, ignored).energy.barrier;
  // The greatest height up to which it does not fold.
  double high = low;
  for (ObjectiveEvaluation next = objective().evaluate(faces_, ignored); next.feasible;
       next = objective().evaluate(faces_, ignored)) {
    high = next.energy.barrier;
    unfolded_to_ += 0.05;
  }
  unfolded_to_ -= 0.05;
  EXPECT_GT(high, low + 1.0);
  EXPECT_LT(unfolded_to_, 40.0);
  for (const bool front : {true, false}) expect_slopes(front);
}

TEST_F(TwoFaces, PicturesAreThoseThatTheRendererMakes) {
  TwoFaceObjective function = objective();
  // A folder keeps heights with 32 bits.
  faces_.front = faces_.front.cast<float>().cast<double>();
  LensFaces gradient;
  ASSERT_TRUE(function.evaluate(faces_, gradient).feasible);
  const std::vector<double> errors = function.errors();
  const SampledSurface nodes = spline_nodes({sample_spline().shape, faces_.exit}, kFaceSamples);
  for (const auto& [goal, error] : {std::pair{near_, errors[0]}, {far_, errors[1]}}) {
    OpticalSetup setup = goal.setup;
    setup.front = height_front(faces_.front, setup.lens_size);
    const std::vector<double> flux =
        flux_of_surface(nodes.mesh, nodes.normals, setup, Executor::serial());
    double absolute = 0.0;
    for (std::size_t i = 0; i < flux.size(); ++i) {
      const auto wanted = static_cast<double>(goal.target.values()[i]);
      absolute += std::fabs(encode(goal.target.total() * flux[i]) - encode(wanted));
    }
    EXPECT_NEAR(absolute / static_cast<double>(flux.size()), error, 1e-5);
    EXPECT_GT(error, 0.01);
  }
}

TEST_F(TwoFaces, SameBitsForAnyNumberOfThreads) {
  TwoFaceObjective one = objective();
  TwoFaceObjective two = objective(Executor::cpu(2));
  LensFaces a;
  LensFaces b;
  EXPECT_EQ(one.evaluate(faces_, a).energy.total, two.evaluate(faces_, b).energy.total);
  EXPECT_EQ(a.exit, b.exit);
  EXPECT_EQ(a.front, b.front);
}

TEST_F(TwoFaces, FoldedLightInsideTheLensIsRefused) {
  TwoFaceObjective function = objective();
  faces_.front = 60.0 * faces_.front;
  LensFaces ignored;
  EXPECT_FALSE(function.evaluate(faces_, ignored).feasible);
}

}  // namespace
}  // namespace lensforge
