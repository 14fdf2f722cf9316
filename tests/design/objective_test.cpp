// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/objective.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "core/transfer.h"
#include "design/energy/boundary_term.h"
#include "design/energy/laplacian_term.h"
#include "design/finite_difference.h"
#include "design/flux/flux_image.h"
#include "design/optics/surface_optics.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;

const Eigen::Vector2d kSize(24.0, 20.0);
const OpticalSetup kSetup = testing::setup_of(kSize, {24, 20}, 60.0);
constexpr GridShape kShape{31, 29};
constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// All weights zero but those named.
struct WeightChoice {
  std::string name;
  ObjectiveWeights weights;

  friend std::ostream& operator<<(std::ostream& out, const WeightChoice& c) {
    return out << c.name;
  }
};

std::vector<WeightChoice> weight_choices() {
  const ObjectiveWeights none{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  std::vector<WeightChoice> choices{{"Paper", {}}};
  const auto add = [&](const char* name, auto... chosen) {
    ObjectiveWeights w = none;
    ((w.*chosen = 1.0), ...);
    choices.push_back({name, w});
  };
  using W = ObjectiveWeights;
  add("Image", &W::image);
  add("Gradient", &W::gradient);
  add("Boundary", &W::boundary);
  add("Barrier", &W::barrier);
  add("FaceAndEdge", &W::smooth, &W::edge);
  add("Laplacian", &W::smooth, &W::laplacian);
  return choices;
}

/// A bumpy mesh with all of its movable coordinates displaced.
SurfaceMesh rough_mesh() {
  Random random(1);
  SurfaceMesh mesh = testing::height_field(kSize, kShape, [&](double x, double y) {
    return 5.0 + 0.3 * std::sin(0.4 * x) * std::cos(0.3 * y) + random.between(0.0, 0.002);
  });
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int k = 0; k < 2; ++k) {
      double& x = mesh.vertices(k, v);
      if (x > 0.0 && x < kSize[k]) x += random.between(-0.05, 0.05);
    }
  }
  return mesh;
}

ObjectiveOptions options_of(SurfaceModel model, const ObjectiveWeights& weights) {
  ObjectiveOptions options;
  options.model = model;
  options.weights = weights;
  options.nu = 0.05;
  // So wide that the area barrier acts on most triangles.
  const double mean = kSize.prod() / (2.0 * (kShape.columns - 1) * (kShape.rows - 1));
  options.area = {0.01 * mean, 1.2 * mean};
  return options;
}

const Image& target() {
  static const Image picture = testing::random_picture(24, 20, 0.1, 2);
  return picture;
}

DesignObjective objective_of(const SurfaceMesh& mesh, const ObjectiveOptions& options,
                             const Executor& executor = Executor::serial()) {
  return {mesh, kSetup, target(), options, executor};
}

DesignObjective::Evaluation evaluate_at(DesignObjective& objective,
                                        const Eigen::Matrix3Xd& vertices) {
  Eigen::Matrix3Xd ignored;
  return objective.evaluate(vertices, ignored);
}

class ObjectiveGradient : public ::testing::TestWithParam<std::tuple<SurfaceModel, WeightChoice>> {
 protected:
  ObjectiveGradient()
      : objective_(objective_of(
            mesh_, options_of(std::get<0>(GetParam()), std::get<1>(GetParam()).weights))) {
    EXPECT_TRUE(objective_.evaluate(mesh_.vertices, gradient_).feasible);
  }

  /// Smallest relative error over a range of steps: large ones cross the corners of pixels, small
  /// ones drown in rounding.
  double error_along(const Eigen::VectorXd& direction, double expected, double scale) {
    const auto f = [&](const Eigen::VectorXd& x) {
      return evaluate_at(objective_, x.reshaped(3, mesh_.vertices.cols())).energy.total;
    };
    double best = std::numeric_limits<double>::infinity();
    for (const double step : {1e-4, 1e-5, 2e-6, 5e-7, 1e-7}) {
      const double slope =
          testing::directional_slope(f, mesh_.vertices.reshaped(), direction, step);
      best = std::min(best, std::fabs(slope - expected) / scale);
    }
    return best;
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

class ObjectiveModels : public ::testing::TestWithParam<SurfaceModel> {};

INSTANTIATE_TEST_SUITE_P(Objective, ObjectiveModels, ::testing::ValuesIn(kModels),
                         testing::model_name);

TEST_P(ObjectiveModels, TotalIsTheWeightedSumOfTheTerms) {
  const SurfaceMesh mesh = rough_mesh();
  const ObjectiveOptions options = options_of(GetParam(), {});
  DesignObjective objective = objective_of(mesh, options);
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.total,
              1e2 * e.image + 1e3 * e.gradient + 1e-3 * e.boundary +
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
  Eigen::Matrix3Xd serial;
  DesignObjective reference = objective_of(mesh, options_of(GetParam(), {}));
  const double total = reference.evaluate(mesh.vertices, serial).energy.total;
  for (const int threads : {1, 2}) {
    Eigen::Matrix3Xd gradient;
    DesignObjective objective =
        objective_of(mesh, options_of(GetParam(), {}), Executor::cpu(threads));
    EXPECT_EQ(objective.evaluate(mesh.vertices, gradient).energy.total, total);
    EXPECT_EQ(gradient, serial);
  }
}

TEST_P(ObjectiveModels, EvaluationsDoNotDependOnTheOneBefore) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, options_of(GetParam(), {}));
  const double before = evaluate_at(objective, mesh.vertices).energy.total;
  Eigen::Matrix3Xd moved = mesh.vertices;
  moved.row(2) *= 1.01;
  EXPECT_NE(evaluate_at(objective, moved).energy.total, before);
  moved(2, 400) += 20.0;
  EXPECT_FALSE(evaluate_at(objective, moved).feasible);
  EXPECT_EQ(evaluate_at(objective, mesh.vertices).energy.total, before);
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
    DesignObjective objective = objective_of(mesh, options_of(model, {}));
    Eigen::Matrix3Xd gradient;
    objective.evaluate(mesh.vertices, gradient);
    const Eigen::Array3Xd held = 1.0 - objective.movable().array();
    EXPECT_EQ((held * gradient.array()).abs().maxCoeff(), 0.0);
    EXPECT_GT((objective.movable().array() * gradient.array()).abs().maxCoeff(), 0.0);
  }
}

/// The smoothness energy with free maps, by iteratively reweighted least squares that go on until
/// nothing moves; written apart from the objective.
class FreeMaps {
 public:
  FreeMaps(const SurfaceMesh& mesh, double nu, double edge_weight)
      : mesh_(mesh),
        topology_(make_topology(mesh)),
        nu_(nu),
        edge_weight_(edge_weight),
        weights_(Eigen::Matrix3Xd::Constant(3, mesh.triangle_count(), welsch(0.0, nu).slope)) {
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      corners_.push_back({mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)});
      frames_.push_back(face_frame(corners_.back()));
    }
    maps_.resize(frames_.size());
    for (int sweep = 0; sweep < 200; ++sweep) {
      for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) fit(t);
      reweight();
    }
  }

  /// Σ H² A
  [[nodiscard]] double face_energy() const {
    double sum = 0.0;
    for (std::size_t t = 0; t < maps_.size(); ++t) {
      const double mean = 0.5 * (maps_[t].a + maps_[t].b);
      sum += mean * mean * 0.5 * area_normal(corners_[t]).norm();
    }
    return sum;
  }
  /// Σ Ψ over the edges.
  [[nodiscard]] double edge_energy() const {
    double sum = 0.0;
    for (std::int64_t t = 0; t < mesh_.triangle_count(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (topology_.neighbours(k, t) >= 0) sum += 0.5 * welsch(mismatch(t, k), nu_).value;
      }
    }
    return sum;
  }
  [[nodiscard]] double total() const { return face_energy() + edge_weight_ * edge_energy(); }

 private:
  [[nodiscard]] std::size_t neighbour(std::int64_t t, int k) const {
    return static_cast<std::size_t>(topology_.neighbours(k, t));
  }
  /// h of an inner edge.
  [[nodiscard]] double mismatch(std::int64_t t, int k) const {
    const auto i = static_cast<std::size_t>(t);
    const std::size_t j = neighbour(t, k);
    return NeighbourOffset(frames_[i], frames_[j]).mismatch(maps_[i]) +
           NeighbourOffset(frames_[j], frames_[i]).mismatch(maps_[j]);
  }
  void fit(std::int64_t t) {
    const auto i = static_cast<std::size_t>(t);
    Eigen::Matrix<double, 7, 3> rows = Eigen::Matrix<double, 7, 3>::Zero();
    Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
    for (int k = 0; k < 3; ++k) {
      if (topology_.neighbours(k, t) < 0) continue;
      const NeighbourOffset offset(frames_[i], frames_[neighbour(t, k)]);
      const double scale = std::sqrt(edge_weight_ * weights_(k, t)) / offset.d.norm();
      rows.row(2 * k) = scale * Eigen::RowVector3d(offset.d.x(), 0.0, offset.d.y());
      rows.row(2 * k + 1) = scale * Eigen::RowVector3d(0.0, offset.d.y(), offset.d.x());
      right.segment<2>(2 * k) = scale * offset.n;
    }
    const double half_root = 0.5 * std::sqrt(0.5 * area_normal(corners_[i]).norm());
    rows.row(6) = half_root * Eigen::RowVector3d(1.0, 1.0, 0.0);
    const Eigen::Vector3d m =
        (rows.transpose() * rows).ldlt().solve(Eigen::Vector3d(rows.transpose() * right));
    maps_[i] = {m[0], m[1], m[2]};
  }
  void reweight() {
    for (std::int64_t t = 0; t < mesh_.triangle_count(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (topology_.neighbours(k, t) >= 0) weights_(k, t) = welsch(mismatch(t, k), nu_).slope;
      }
    }
  }

  const SurfaceMesh& mesh_;
  MeshTopology topology_;
  double nu_;
  double edge_weight_;
  Eigen::Matrix3Xd weights_;
  std::vector<Corners> corners_;
  std::vector<FaceFrame> frames_;
  std::vector<WeingartenMap> maps_;
};

ObjectiveOptions smoothness_options(double nu) {
  ObjectiveOptions options = options_of(SurfaceModel::kFacet, {});
  options.nu = nu;
  return options;
}

double smoothness_total(const EnergyValues& e) { return e.face + 3.0 * e.edge; }

TEST(Objective, SmoothnessIsTheWelschSumOfTheBestMapsWhereMostEdgesAreSmooth) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, smoothness_options(0.2));
  const double computed = smoothness_total(evaluate_at(objective, mesh.vertices).energy);
  const double expected = FreeMaps(mesh, 0.2, 3.0).total();
  RecordProperty("gap", std::to_string(computed / expected - 1.0));
  EXPECT_NEAR(computed / expected, 1.0, 2e-3);
}

TEST(Objective, SmoothnessIsAnUpperBoundWhereMostEdgesAreCreases) {
  const SurfaceMesh mesh = rough_mesh();
  for (const double nu : {0.02, 0.05}) {
    DesignObjective objective = objective_of(mesh, smoothness_options(nu));
    const double computed = smoothness_total(evaluate_at(objective, mesh.vertices).energy);
    const double gap = computed / FreeMaps(mesh, nu, 3.0).total() - 1.0;
    RecordProperty("gap_at_nu_" + std::to_string(nu), std::to_string(gap));
    EXPECT_GE(gap, 0.0);
    EXPECT_LT(gap, 0.25);
  }
}

TEST(Objective, SmoothnessIsAnUpperBoundElsewhere) {
  const SurfaceMesh mesh = rough_mesh();
  DesignObjective objective = objective_of(mesh, smoothness_options(0.02));
  Random random(6);
  for (const double size : {1e-3, 4e-3, 2e-2}) {
    SurfaceMesh moved = mesh;
    for (double& z : moved.vertices.row(2)) z += random.between(-size, size);
    const double bound = smoothness_total(evaluate_at(objective, moved.vertices).energy);
    EXPECT_GT(bound, FreeMaps(moved, 0.02, 3.0).total()) << size;
  }
}

TEST(Objective, AFlatLensHasNoCurvatureEnergy) {
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  DesignObjective objective = objective_of(mesh, smoothness_options(0.05));
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.face, 0.0, 1e-20);
  EXPECT_NEAR(e.edge, 0.0, 1e-12);
}

TEST(Objective, ASphereHasItsMeanCurvatureEnergy) {
  const double radius = 150.0;
  const SurfaceMesh mesh = testing::height_field(kSize, {61, 59}, [&](double x, double y) {
    const Eigen::Vector2d from_axis = Eigen::Vector2d(x, y) - 0.5 * kSize;
    return 5.0 - radius + std::sqrt(radius * radius - from_axis.squaredNorm());
  });
  ObjectiveOptions options = smoothness_options(0.02);
  options.area = default_area_barrier(kSetup, mesh.triangle_count());
  DesignObjective objective = objective_of(mesh, options);
  double area = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    area += 0.5 * area_normal({mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}).norm();
  }
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.face * radius * radius / area, 1.0, 0.015);
  // Of 10,500 edges.
  EXPECT_LT(e.edge, 15.0);
}

TEST(Objective, ACreaseCostsItsEdgesAndNoMore) {
  // Two planes that meet in the middle row: the Welsch function bounds what the crease costs.
  const SurfaceMesh mesh = testing::height_field(
      kSize, kShape, [](double, double y) { return 5.0 + 0.3 * std::fabs(y - 0.5 * kSize.y()); });
  DesignObjective objective = objective_of(mesh, smoothness_options(0.02));
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.edge, kShape.columns - 1, 1e-3);
  EXPECT_NEAR(e.face, 0.0, 1e-3);
}

TEST(Objective, DefaultAreaBarrierIsAShareOfTheMeanTriangle) {
  const AreaBarrier barrier = default_area_barrier(kSetup, 960);
  EXPECT_DOUBLE_EQ(barrier.lower, 0.01 * 0.5);
  EXPECT_DOUBLE_EQ(barrier.upper, 0.05 * 0.5);
}

}  // namespace
}  // namespace lensforge
