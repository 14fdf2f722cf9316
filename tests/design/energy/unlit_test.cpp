// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/image/transfer.h"
#include "design/energy/objective.h"
#include "design/energy/picture_terms.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/random_input.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {
namespace {

using testing::kSetup;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ImageTriangle triangle_at(const Eigen::Vector2d& centroid) {
  const Eigen::Vector2d side(0.3, -0.1);
  return {centroid + side, centroid - side, centroid, 1.0};
}

TEST(UnlitTerm, IsTheSquaredDistanceFromTheInnerPixel) {
  ImageTriangle bar;
  // Pixel 33 of rows of 10 is column 3, row 3.
  EXPECT_EQ(unlit_term(triangle_at({3.5, 3.5}), 33, 10, 0.2, 1.0, bar), 0.0);
  EXPECT_TRUE(bar.p0.isZero() && bar.p1.isZero() && bar.p2.isZero());
  EXPECT_NEAR(unlit_term(triangle_at({1.25, 5.75}), 33, 10, 0.2, 1.0, bar), 0.04 * (4.0 + 4.0),
              1e-12);
}

TEST(UnlitTerm, AdjointEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 100; ++i) {
    Eigen::VectorXd x(6);
    for (double& value : x) value = random.between(4.5, 8.0);
    const auto f = [](const Eigen::VectorXd& at) {
      ImageTriangle ignored;
      return 0.7 * unlit_term({at.segment<2>(0), at.segment<2>(2), at.segment<2>(4), 1.0}, 33, 10,
                              0.3, 0.7, ignored);
    };
    ImageTriangle bar;
    unlit_term({x.segment<2>(0), x.segment<2>(2), x.segment<2>(4), 1.0}, 33, 10, 0.3, 0.7, bar);
    Eigen::VectorXd computed(6);
    computed << bar.p0, bar.p1, bar.p2;
    EXPECT_LT(testing::plateau_error(computed, f, x, 1e-4), 1e-7);
  }
}

/// A picture that wants light everywhere and gets it but for some pixels.
struct Scene {
  std::vector<double> light = std::vector<double>(48, 0.5);
  std::vector<double> wanted = std::vector<double>(48, 0.5);

  [[nodiscard]] std::vector<std::int32_t> led(const Eigen::Matrix2Xd& centroids) const {
    return lead_to_unlit_pixels({8, 6, light, wanted}, centroids);
  }
};

Eigen::Matrix2Xd points(const std::vector<Eigen::Vector2d>& list) {
  Eigen::Matrix2Xd matrix(2, static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = list[i];
  return matrix;
}

TEST(UnlitPixels, NoneWhereAllAreLit) {
  const Scene scene;
  EXPECT_EQ(scene.led(points({{1.5, 1.5}, {6.0, 4.0}})),
            (std::vector<std::int32_t>{kNoPixel, kNoPixel}));
}

TEST(UnlitPixels, TheNearestFacetIsLed) {
  Scene scene;
  scene.light[2 * 8 + 3] = 0.1;
  EXPECT_EQ(scene.led(points({{2.2, 2.5}, {2.6, 2.5}, {2.4, 2.5}})),
            (std::vector<std::int32_t>{kNoPixel, 19, kNoPixel}));
}

TEST(UnlitPixels, AFacetThatIsAloneInItsPixelIsLeftThereIfAnotherIsNear) {
  Scene scene;
  scene.light[2 * 8 + 3] = 0.0;
  EXPECT_EQ(scene.led(points({{2.6, 2.5}, {4.8, 2.5}, {4.6, 2.5}})),
            (std::vector<std::int32_t>{kNoPixel, kNoPixel, 19}));
  EXPECT_EQ(scene.led(points({{2.6, 2.5}, {6.1, 2.5}, {6.2, 2.5}})),
            (std::vector<std::int32_t>{19, kNoPixel, kNoPixel}));
}

TEST(UnlitPixels, NoFacetIsLedToTwo) {
  Scene scene;
  scene.light[2 * 8 + 3] = scene.light[2 * 8 + 4] = 0.0;
  const std::vector<std::int32_t> led = scene.led(points({{3.9, 1.5}, {3.8, 1.5}, {3.7, 1.5}}));
  EXPECT_EQ(led, (std::vector<std::int32_t>{20, kNoPixel, 19}));
}

TEST(UnlitPixels, BlackMayStayUnlitAndFarFacetsStay) {
  Scene scene;
  scene.light[0] = 0.0;
  EXPECT_EQ(scene.led(points({{4.1, 0.5}}))[0], kNoPixel);  // Four columns off.
  EXPECT_EQ(scene.led(points({{3.9, 0.5}}))[0], 0);
  scene.wanted[0] = 0.0;
  EXPECT_EQ(scene.led(points({{3.9, 0.5}}))[0], kNoPixel);
}

TEST(UnlitPixels, FacetsThatLandNowhereAreLeftOut) {
  Scene scene;
  scene.light[47] = 0.0;
  // Outside counts for the nearest pixel.
  EXPECT_EQ(scene.led(points({{kNan, 1.0}, {40.0, 40.0}, {1.0, kNan}})),
            (std::vector<std::int32_t>{kNoPixel, 47, kNoPixel}));
  EXPECT_TRUE(scene.led(Eigen::Matrix2Xd(2, 0)).empty());
}

/// A lens that throws its light to one side: a strip of the picture gets none.
SurfaceMesh tilted() {
  SurfaceMesh mesh = testing::rough_mesh();
  mesh.vertices.row(2) += 0.06 * mesh.vertices.row(0);
  return mesh;
}

ObjectiveOptions picture_alone() {
  ObjectiveOptions options =
      testing::options_of(SurfaceModel::kFacet, {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  options.area = default_area_barrier(kSetup, tilted().triangle_count());
  return options;
}

TEST(UnlitObjective, GradientEqualsCentralDifferences) {
  const SurfaceMesh mesh = tilted();
  DesignObjective objective = testing::objective_of(mesh, picture_alone());
  Eigen::Matrix3Xd gradient;
  const DesignObjective::Evaluation e = objective.evaluate(mesh.vertices, gradient);
  EXPECT_GT(e.energy.unlit, 0.0);
  EXPECT_DOUBLE_EQ(e.energy.total, e.energy.image + e.energy.unlit);
  testing::Random random(5);
  Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, gradient.cols());
  for (double& d : direction.reshaped()) d = random.between(-1.0, 1.0);
  direction.array() *= objective.movable().array();
  const auto f = [&](const Eigen::VectorXd& x) {
    return testing::evaluate_at(objective, x.reshaped(3, gradient.cols())).energy.total;
  };
  const double expected = gradient.cwiseProduct(direction).sum();
  std::vector<double> errors;
  for (const double step : {1e-5, 1e-6, 1e-7}) {
    const double slope =
        testing::directional_slope(f, mesh.vertices.reshaped(), direction.reshaped(), step);
    errors.push_back(std::fabs(slope - expected));
  }
  EXPECT_LT(testing::plateau_error(errors), 1e-6 * gradient.norm());
}

TEST(UnlitObjective, TheSmoothModelHasNone) {
  ObjectiveOptions options = picture_alone();
  options.model = SurfaceModel::kSmooth;
  DesignObjective objective = testing::objective_of(tilted(), options);
  EXPECT_EQ(testing::evaluate_at(objective, tilted().vertices).energy.unlit, 0.0);
}

TEST(UnlitObjective, OptimisationLightsThePixels) {
  SurfaceMesh mesh = tilted();
  const auto unlit = [](const DesignObjective::Evaluation& e) { return e.energy.unlit; };
  ObjectiveOptions all_terms = picture_alone();
  all_terms.weights = {};
  DesignObjective before = testing::objective_of(mesh, all_terms);
  GuidedOptimization stage(mesh, kSetup, testing::target(), all_terms, Executor::serial());
  LbfgsOptions options;
  options.max_iterations = 200;
  stage.run(
      options, [](int, const DesignObjective::Evaluation&) { return true; }, mesh);
  DesignObjective after = testing::objective_of(mesh, all_terms);
  EXPECT_LT(unlit(testing::evaluate_at(after, mesh.vertices)),
            0.1 * unlit(testing::evaluate_at(before, tilted().vertices)));
}

}  // namespace
}  // namespace lensforge
