// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/objective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "core/image/color.h"
#include "design/energy/objective_kernels.h"
#include "design/energy/picture_terms.h"
#include "design/energy/smoothness.h"
#include "design/finite_difference.h"
#include "design/flux/flux_image.h"
#include "design/objective_setups.h"
#include "design/random_input.h"
#include "design/render/render_flux.h"

namespace lensforge::objective_test {
namespace {

using testing::correspondence;
using testing::evaluate_at;
using testing::Goal;
using testing::kGoals;
using testing::kModels;
using testing::kSetup;
using testing::kShape;
using testing::kSize;
using testing::objective_of;
using testing::options_of;
using testing::Random;
using testing::rough_mesh;
using testing::target;

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

/// All weights zero but those named.
struct WeightChoice {
  std::string name;
  ObjectiveWeights weights;
  Goal goal = Goal::kPicture;

  friend std::ostream& operator<<(std::ostream& out, const WeightChoice& c) {
    return out << c.name;
  }
};

std::vector<WeightChoice> weight_choices() {
  const ObjectiveWeights none{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  std::vector<WeightChoice> choices{{"Paper", {}, Goal::kPicture},
                                    {"PaperCorrespondence", {}, Goal::kCorrespondence}};
  const auto add = [&](const char* name, Goal goal, auto... chosen) {
    ObjectiveWeights w = none;
    ((w.*chosen = 1.0), ...);
    choices.push_back({name, w, goal});
  };
  using W = ObjectiveWeights;
  add("Image", Goal::kPicture, &W::image);
  add("Gradient", Goal::kPicture, &W::gradient);
  add("Boundary", Goal::kPicture, &W::boundary);
  add("Barrier", Goal::kPicture, &W::barrier);
  add("FaceAndEdge", Goal::kPicture, &W::smooth, &W::edge);
  add("Laplacian", Goal::kPicture, &W::smooth, &W::laplacian);
  add("Align", Goal::kCorrespondence, &W::align);
  add("Flux", Goal::kCorrespondence, &W::flux);
  return choices;
}

class ObjectiveGradient : public ::testing::TestWithParam<std::tuple<SurfaceModel, WeightChoice>> {
 protected:
  ObjectiveGradient()
      : objective_(objective_of(
            mesh_, options_of(std::get<0>(GetParam()), std::get<1>(GetParam()).weights),
            Executor::serial(), std::get<1>(GetParam()).goal)) {
    EXPECT_TRUE(objective_.evaluate(mesh_.vertices, gradient_).feasible);
  }

  /// Smallest relative error that two neighbouring steps keep: large steps cross the corners of
  /// pixels, small ones drown in rounding.
  double error_along(const Eigen::VectorXd& direction, double expected, double scale) {
    const auto f = [&](const Eigen::VectorXd& x) {
      return evaluate_at(objective_, x.reshaped(3, mesh_.vertices.cols())).energy.total;
    };
    std::vector<double> errors;
    for (const double step : {1e-4, 1e-5, 2e-6, 5e-7, 1e-7}) {
      const double slope =
          testing::directional_slope(f, mesh_.vertices.reshaped(), direction, step);
      errors.push_back(std::fabs(slope - expected) / scale);
    }
    return testing::plateau_error(errors);
  }

  SurfaceMesh mesh_ = rough_mesh();
  DesignObjective objective_;
  Eigen::Matrix3Xd gradient_;
};

TEST_P(ObjectiveGradient, EqualsCentralDifferencesAlongRandomDirections) {
  Random random(3);
  double worst = 0.0;
  // Heights alone, x and y alone, all of them.
  for (const auto& [first, count] : {std::pair{2, 1}, {0, 2}, {0, 3}}) {
    Eigen::Matrix3Xd direction = Eigen::Matrix3Xd::Zero(3, gradient_.cols());
    for (double& d : direction.middleRows(first, count).reshaped()) d = random.between(-1.0, 1.0);
    direction.array() *= objective_.movable().array();
    const Eigen::VectorXd products = gradient_.cwiseProduct(direction).reshaped();
    const double scale = std::max(std::fabs(products.sum()), products.norm());
    if (scale == 0.0) continue;
    worst = std::max(worst, error_along(direction.reshaped(), products.sum(), scale));
    EXPECT_LE(worst, 1e-6) << first << ' ' << count << ' ' << products.sum();
  }
  EXPECT_GT(gradient_.norm(), 0.0);
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

TEST_P(ObjectiveGradient, EqualsCentralDifferencesCoordinateByCoordinate) {
  Random random(4);
  const Eigen::VectorXd gradient = gradient_.reshaped();
  const double scale = gradient.cwiseAbs().maxCoeff();
  double worst = 0.0;
  for (int k = 0; k < 30; ++k) {
    const Eigen::Index i = random.below(static_cast<int>(gradient.size()));
    if (objective_.movable().reshaped()[i] == 0.0) continue;
    const Eigen::VectorXd direction = Eigen::VectorXd::Unit(gradient.size(), i);
    worst = std::max(worst, error_along(direction, gradient[i], scale));
    EXPECT_LE(worst, 1e-6) << i;
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

INSTANTIATE_TEST_SUITE_P(
    Objective, ObjectiveGradient,
    ::testing::Combine(::testing::ValuesIn(kModels), ::testing::ValuesIn(weight_choices())),
    [](const ::testing::TestParamInfo<std::tuple<SurfaceModel, WeightChoice>>& choice) {
      const bool facet = std::get<0>(choice.param) == SurfaceModel::kFacet;
      return (facet ? "Facet" : "Smooth") + std::get<1>(choice.param).name;
    });

constexpr ObjectiveWeights kWeights{1e2, 1e3, 1e-3, 2e1, 1e-8, 3e0, 2e-1, 2e0, 1e1};

class ObjectiveModels : public ::testing::TestWithParam<SurfaceModel> {};

INSTANTIATE_TEST_SUITE_P(Objective, ObjectiveModels, ::testing::ValuesIn(kModels),
                         testing::model_name);

TEST_P(ObjectiveModels, TotalIsTheWeightedSumOfTheTerms) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), kWeights));
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.total,
              1e2 * (e.image + e.unlit) + 1e3 * e.gradient + 1e-3 * e.boundary +
                  2e1 * (e.face + 3.0 * e.edge + 0.2 * e.laplacian) + 1e-8 * e.barrier,
              1e-12 * e.total);
  for (const double term :
       {e.image, e.gradient, e.boundary, e.face, e.edge, e.laplacian, e.barrier})
    EXPECT_GT(term, 0.0);
}

TEST_P(ObjectiveModels, PictureTermsAreThoseOfTheRenderedPicture) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), {}));
  const DesignObjective::Evaluation result = evaluate_at(objective, mesh.vertices);
  FluxImage image(24, 20);
  const auto triangles = project_surface(mesh, kSetup, GetParam(), Executor::serial());
  const auto flux = image.render(Executor::serial(), triangles);
  double squares = 0.0;
  double absolute = 0.0;
  for (std::size_t i = 0; i < flux.size(); ++i) {
    const double shown = encode(flux[i] * target().total());
    const double error = shown - encode(static_cast<double>(target().values()[i]));
    squares += error * error;
    absolute += std::fabs(error);
  }
  EXPECT_NEAR(result.energy.image, squares, 1e-10 * squares);
  EXPECT_NEAR(result.mae, absolute / 480.0, 1e-12);
  double boundary = 0.0;
  for (const ImageTriangle& t : triangles) {
    for (const Eigen::Vector2d& p : {t.p0, t.p1, t.p2}) {
      boundary += excess_outside(p, 24.0, 20.0).squaredNorm();
    }
  }
  EXPECT_NEAR(result.energy.boundary, boundary, 1e-10 * boundary);
}

TEST_P(ObjectiveModels, TotalForACorrespondenceIsTheWeightedSumOfItsTerms) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), kWeights),
                                           Executor::serial(), Goal::kCorrespondence);
  const DesignObjective::Evaluation result = evaluate_at(objective, mesh.vertices);
  const EnergyValues& e = result.energy;
  EXPECT_NEAR(e.total,
              2e0 * e.align + 1e1 * e.flux + 2e1 * (e.face + 3.0 * e.edge + 0.2 * e.laplacian) +
                  1e-8 * e.barrier,
              1e-12 * e.total);
  for (const double term : {e.align, e.flux, e.face, e.edge, e.laplacian, e.barrier}) {
    EXPECT_GT(term, 0.0);
  }
  for (const double term : {e.image, e.gradient, e.boundary, result.mae}) EXPECT_EQ(term, 0.0);
}

TEST_P(ObjectiveModels, CorrespondenceTermsAreThoseOfTheImageTriangles) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective =
      objective_of(mesh, options_of(GetParam(), {}), Executor::serial(), Goal::kCorrespondence);
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  const auto triangles = project_surface(mesh, kSetup, GetParam(), Executor::serial());
  double align = 0.0;
  double flux = 0.0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto f = static_cast<Eigen::Index>(i);
    const ImageTriangle& t = triangles[i];
    align += ((t.p0 + t.p1 + t.p2) / 3.0 - correspondence().centroids.col(f)).squaredNorm();
    // In units of the mean pixel's flux, of 24 × 20.
    flux += std::pow((t.flux - correspondence().flux[f]) * 480.0, 2);
  }
  EXPECT_NEAR(e.align, align, 1e-10 * align);
  EXPECT_NEAR(e.flux, flux, 1e-10 * flux);
}

TEST_P(ObjectiveModels, LengthsCountInPixels) {
  const SurfaceMesh mesh = rough_mesh();
  OpticalSetup finer = kSetup;
  finer.pixels *= 2;
  const ObjectiveOptions options = options_of(GetParam(), {});
  DesignObjective coarse = objective_of(mesh, options);
  DesignObjective fine(mesh, finer, testing::random_picture(48, 40, 0.1, 5), options,
                       Executor::serial());
  const EnergyValues a = evaluate_at(coarse, mesh.vertices).energy;
  const EnergyValues b = evaluate_at(fine, mesh.vertices).energy;
  EXPECT_NEAR(b.boundary / a.boundary, 4.0, 1e-9);
  EXPECT_NEAR(b.laplacian / a.laplacian, 4.0, 1e-9);
  EXPECT_NEAR(b.face, a.face, 1e-9 * a.face);
  EXPECT_NEAR(b.edge, a.edge, 1e-9 * a.edge);
}

TEST_P(ObjectiveModels, ThreadCountDoesNotChangeABit) {
  const SurfaceMesh mesh = rough_mesh();
  const ObjectiveOptions options = options_of(GetParam(), {});
  for (const Goal goal : kGoals) {
    Eigen::Matrix3Xd serial;
    DesignObjective reference = objective_of(mesh, options, Executor::serial(), goal);
    const double total = reference.evaluate(mesh.vertices, serial).energy.total;
    for (const int threads : {1, 2}) {
      Eigen::Matrix3Xd gradient;
      DesignObjective objective = objective_of(mesh, options, Executor::cpu(threads), goal);
      EXPECT_EQ(objective.evaluate(mesh.vertices, gradient).energy.total, total);
      EXPECT_EQ(gradient, serial);
    }
  }
}

TEST_P(ObjectiveModels, EvaluationsDoNotDependOnTheOneBefore) {
  const SurfaceMesh mesh = rough_mesh();
  for (const Goal goal : kGoals) {
    DesignObjective objective =
        objective_of(mesh, options_of(GetParam(), {}), Executor::serial(), goal);
    const double before = evaluate_at(objective, mesh.vertices).energy.total;
    Eigen::Matrix3Xd moved = mesh.vertices;
    moved.row(2) *= 1.01;
    EXPECT_NE(evaluate_at(objective, moved).energy.total, before);
    moved(2, 400) += 20.0;
    EXPECT_FALSE(evaluate_at(objective, moved).feasible);
    EXPECT_EQ(evaluate_at(objective, mesh.vertices).energy.total, before);
  }
}

TEST_P(ObjectiveModels, AFoldedTriangleIsNotAllowed) {
  SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), {}));
  mesh.vertices(0, 14 * kShape.columns + 15) += 1.2;
  EXPECT_FALSE(evaluate_at(objective, mesh.vertices).feasible);
}

TEST_P(ObjectiveModels, ATooSteepTriangleIsNotAllowed) {
  SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), {}));
  mesh.vertices(2, 14 * kShape.columns + 15) += 1.0;
  EXPECT_FALSE(evaluate_at(objective, mesh.vertices).feasible);
}

TEST(Objective, OnlyTheBordersOwnCoordinateIsHeld) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const DesignObjective objective = objective_of(mesh, options_of(SurfaceModel::kFacet, {}));
  const Eigen::Matrix3Xd& movable = objective.movable();
  ASSERT_EQ(movable.cols(), mesh.vertices.cols());
  for (Eigen::Index v = 0; v < movable.cols(); ++v) {
    const Eigen::Index column = v % kShape.columns;
    const Eigen::Index row = v / kShape.columns;
    EXPECT_EQ(movable(0, v), column == 0 || column == kShape.columns - 1 ? 0.0 : 1.0) << v;
    EXPECT_EQ(movable(1, v), row == 0 || row == kShape.rows - 1 ? 0.0 : 1.0) << v;
    EXPECT_EQ(movable(2, v), 1.0) << v;
  }
}

TEST(Objective, HeldCoordinatesHaveNoGradient) {
  const SurfaceMesh mesh = rough_mesh();
  for (const SurfaceModel model : kModels) {
    for (const Goal goal : kGoals) {
      DesignObjective objective =
          objective_of(mesh, options_of(model, {}), Executor::serial(), goal);
      Eigen::Matrix3Xd gradient;
      objective.evaluate(mesh.vertices, gradient);
      const Eigen::Array3Xd held = 1.0 - objective.movable().array();
      EXPECT_EQ((held * gradient.array()).abs().maxCoeff(), 0.0);
      EXPECT_GT((objective.movable().array() * gradient.array()).abs().maxCoeff(), 0.0);
    }
  }
}

TEST(Objective, DefaultAreaBarrierIsAShareOfTheMeanTriangle) {
  const AreaBarrier barrier = default_area_barrier(kSetup, 960);
  EXPECT_DOUBLE_EQ(barrier.lower, 0.001 * 0.5);
  EXPECT_DOUBLE_EQ(barrier.upper, 0.005 * 0.5);
}

}  // namespace

}  // namespace lensforge::objective_test
