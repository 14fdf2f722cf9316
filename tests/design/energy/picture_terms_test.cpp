// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/picture_terms.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/color.h"
#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/random_input.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {
namespace {

using testing::kSetup;
using testing::Random;

// Checks that the image term and the gradient term share.

constexpr int kTermColumns = 9;
constexpr int kTermRows = 7;

using PictureTerm = FinishedSum<1> (*)(const Executor&, const PictureError&, double,
                                       std::span<double>);

Eigen::VectorXd random_error(int count, std::uint64_t seed) {
  testing::Random random(seed);
  Eigen::VectorXd error(count);
  for (double& e : error) e = random.between(-1.0, 1.0);
  return error;
}

double value_of(PictureTerm term, const Eigen::VectorXd& error) {
  std::vector<double> ignored(static_cast<std::size_t>(error.size()));
  return term(Executor::serial(), {kTermColumns, kTermRows, error.data()}, 1.0, ignored).get()[0];
}

void expect_adjoint_equals_central_differences(PictureTerm term) {
  const Eigen::VectorXd error = random_error(kTermColumns * kTermRows, 1);
  std::vector<double> bar(static_cast<std::size_t>(error.size()), 5.0);
  term(Executor::serial(), {kTermColumns, kTermRows, error.data()}, 0.3, bar);
  const auto f = [&](const Eigen::VectorXd& x) { return 0.3 * value_of(term, x); };
  const Eigen::Map<const Eigen::VectorXd> computed(bar.data(), error.size());
  EXPECT_LT(testing::plateau_error(computed.array() - 5.0, f, error, 1e-2), 1e-10);
}

void expect_same_bits_for_any_thread_count(PictureTerm term) {
  constexpr int kSide = 150;
  const Eigen::VectorXd error = random_error(kSide * kSide, 2);
  const PictureError picture{kSide, kSide, error.data()};
  std::vector<double> serial(static_cast<std::size_t>(error.size()));
  std::vector<double> parallel(serial.size());
  const double value = term(Executor::serial(), picture, 0.3, serial).get()[0];
  EXPECT_EQ(value, term(Executor::cpu(2), picture, 0.3, parallel).get()[0]);
  EXPECT_EQ(serial, parallel);
}

TEST(ImageTerm, IsTheSumOfSquares) {
  const Eigen::VectorXd error = random_error(kTermColumns * kTermRows, 3);
  EXPECT_NEAR(value_of(&image_term<Executor>, error), error.squaredNorm(), 1e-12);
}

TEST(ImageTerm, AdjointEqualsCentralDifferences) {
  expect_adjoint_equals_central_differences(&image_term<Executor>);
}

TEST(ImageTerm, ThreadCountDoesNotChangeABit) {
  expect_same_bits_for_any_thread_count(&image_term<Executor>);
}

TEST(GradientTerm, IsTheSumOfSquaredForwardDifferences) {
  const Eigen::VectorXd error = random_error(kTermColumns * kTermRows, 4);
  const auto rows = error.reshaped(kTermColumns, kTermRows);  // Column-major: a column is a row.
  double expected = 0.0;
  for (int r = 0; r < kTermRows; ++r) {
    for (int c = 0; c < kTermColumns; ++c) {
      if (c + 1 < kTermColumns) expected += std::pow(rows(c + 1, r) - rows(c, r), 2);
      if (r + 1 < kTermRows) expected += std::pow(rows(c, r + 1) - rows(c, r), 2);
    }
  }
  EXPECT_NEAR(value_of(&gradient_term<Executor>, error), expected, 1e-12);
}

TEST(GradientTerm, IgnoresAConstantOffset) {
  const Eigen::VectorXd offset = Eigen::VectorXd::Constant(kTermColumns * kTermRows, 0.7);
  EXPECT_EQ(value_of(&gradient_term<Executor>, offset), 0.0);
}

TEST(GradientTerm, AdjointEqualsCentralDifferences) {
  expect_adjoint_equals_central_differences(&gradient_term<Executor>);
}

TEST(GradientTerm, ThreadCountDoesNotChangeABit) {
  expect_same_bits_for_any_thread_count(&gradient_term<Executor>);
}

constexpr double kWide = 30.0;
constexpr double kHigh = 20.0;

double boundary_of(const ImageTriangle& t) {
  ImageTriangle ignored;
  return boundary_term(t, kWide, kHigh, 1.0, ignored);
}

TEST(BoundaryTerm, IsZeroInsideThePictureAndOnItsBorder) {
  ImageTriangle bar;
  EXPECT_EQ(boundary_term({{0.0, 0.0}, {30.0, 3.0}, {7.0, 20.0}, 1.0}, kWide, kHigh, 2.0, bar),
            0.0);
  EXPECT_TRUE(bar.p0.isZero() && bar.p1.isZero() && bar.p2.isZero());
}

TEST(BoundaryTerm, IsTheSquaredDistanceFromThePicture) {
  EXPECT_DOUBLE_EQ(boundary_of({{-3.0, 5.0}, {7.0, 24.0}, {33.0, -4.0}, 1.0}), 9.0 + 16.0 + 25.0);
}

TEST(BoundaryTerm, AdjointEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd x(6);
    for (double& value : x) value = random.between(-15.0, 45.0);
    x[0] = -random.between(1.0, 5.0);
    const auto unpack = [](const Eigen::VectorXd& at) {
      return ImageTriangle{at.segment<2>(0), at.segment<2>(2), at.segment<2>(4), 1.0};
    };
    const auto f = [&](const Eigen::VectorXd& at) { return 0.7 * boundary_of(unpack(at)); };
    ImageTriangle bar;
    boundary_term(unpack(x), kWide, kHigh, 0.7, bar);
    Eigen::VectorXd computed(6);
    computed << bar.p0, bar.p1, bar.p2;
    EXPECT_LT(testing::plateau_error(computed, f, x, 1e-4), 1e-7);
  }
}

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

constexpr double kPixels = 480.0;

ImageTriangle unpack(const Eigen::VectorXd& x) {
  return {x.segment<2>(0), x.segment<2>(2), x.segment<2>(4), x[6]};
}

Eigen::VectorXd pack(const ImageTriangle& t) {
  Eigen::VectorXd x(7);
  x << t.p0, t.p1, t.p2, t.flux;
  return x;
}

TEST(CorrespondenceTerm, IsTheSquaredDistanceOfTheCentroidAndTheSquaredExcessOfFlux) {
  // Centroid (3, 4), wanted at (1, 5); of 1/100 of the light 1/120 is wanted, of 480 pixels 4.8
  // and 4.
  ImageTriangle bar;
  const CorrespondenceValues v =
      correspondence_term({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01}, {1.0, 5.0}, 1.0 / 120.0,
                          kPixels, {.align = 2.0, .flux = 3.0}, bar);
  EXPECT_DOUBLE_EQ(v.align, 4.0 + 1.0);
  EXPECT_NEAR(v.flux, 0.64, 1e-13);
}

TEST(CorrespondenceTerm, VanishesWhereTheLightIsAsWanted) {
  ImageTriangle bar;
  const CorrespondenceValues v =
      correspondence_term({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01}, {3.0, 4.0}, 0.01, kPixels,
                          {.align = 2.0, .flux = 3.0}, bar);
  EXPECT_EQ(v.align, 0.0);
  EXPECT_EQ(v.flux, 0.0);
  EXPECT_TRUE(pack(bar).isZero());
}

TEST(CorrespondenceTerm, ShapeOfATriangleDoesNotMatter) {
  ImageTriangle ignored;
  const auto value = [&](const ImageTriangle& t) {
    return correspondence_term(t, {7.0, 7.0}, 0.02, kPixels, {.align = 1.0, .flux = 1.0}, ignored);
  };
  const CorrespondenceValues flat = value({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01});
  const CorrespondenceValues turned = value({{8.0, -1.0}, {-2.0, 11.0}, {3.0, 2.0}, 0.01});
  EXPECT_DOUBLE_EQ(flat.align, turned.align);
  EXPECT_DOUBLE_EQ(flat.flux, turned.flux);
}

TEST(CorrespondenceTerm, AdjointAddsAndEqualsCentralDifferences) {
  Random random(1);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d centroid = 20.0 * random.vector2();
    const double flux = random.between(0.0, 0.01);
    const double align_weight = random.magnitude(1e-2, 1e2);
    const double flux_weight = random.magnitude(1e-2, 1e2);
    Eigen::VectorXd x(7);
    for (double& value : x) value = random.between(-20.0, 20.0);
    x[6] = random.between(0.0, 0.01);
    const auto f = [&](const Eigen::VectorXd& at) {
      ImageTriangle ignored;
      const CorrespondenceValues v = correspondence_term(unpack(at), centroid, flux, kPixels,
                                                         {.align = 0.0, .flux = 0.0}, ignored);
      return align_weight * v.align + flux_weight * v.flux;
    };
    const Eigen::VectorXd before = Eigen::VectorXd::LinSpaced(7, -1.0, 1.0);
    ImageTriangle bar = unpack(before);
    correspondence_term(unpack(x), centroid, flux, kPixels,
                        {.align = align_weight, .flux = flux_weight}, bar);
    const Eigen::VectorXd computed = pack(bar) - before;
    for (const double step : {1e-3, 5e-4}) {
      const Eigen::VectorXd expected = testing::numeric_gradient(f, x, step);
      // Corners and flux have scales of their own.
      worst = std::max({worst, testing::gradient_error(computed.head(6), expected.head(6)),
                        std::fabs(computed[6] / expected[6] - 1.0)});
    }
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
  EXPECT_LT(worst, 1e-7);
}

}  // namespace

}  // namespace lensforge
