// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/smoothness.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/random_corners.h"
#include "design/random_input.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::evaluate_at;
using testing::kSetup;
using testing::kShape;
using testing::kSize;
using testing::objective_of;
using testing::options_of;
using testing::Random;
using testing::rough_mesh;

TEST(FaceFrame, StandsOnTheTriangle) {
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const Corners t = testing::random_corners(random);
    const FaceFrame frame = face_frame(t);
    EXPECT_NEAR(frame.n.norm(), 1.0, 1e-14);
    EXPECT_NEAR(frame.n.dot(t.v2 - t.v0), 0.0, 1e-13);
    EXPECT_NEAR(frame.n.dot(t.v1 - t.v0), 0.0, 1e-13);
    EXPECT_NEAR(frame.n.dot(t.v2 - frame.c), 0.0, 1e-13);
  }
}

TEST(TangentBasis, IsOrthonormalAndTurnsLeftSeenAgainstTheNormal) {
  Random random(4);
  std::vector<Eigen::Vector3d> normals{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}};
  for (int k = 0; k < 200; ++k) normals.push_back(random.near_z(0.5));
  for (const Eigen::Vector3d& n : normals) {
    const TangentBasis basis(n);
    EXPECT_NEAR(basis.e1.norm(), 1.0, 1e-14);
    EXPECT_NEAR(basis.e1.dot(n), 0.0, 1e-14);
    EXPECT_LT((n.cross(basis.e1) - basis.e2).norm(), 1e-14);
  }
}

TEST(TangentBasis, LocalCoordinatesLeadBackToTheTangentPart) {
  Random random(5);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d n = random.near_z(0.5);
    const Eigen::Vector3d v = random.vector3();
    const TangentBasis basis(n);
    EXPECT_LT((basis.world(basis.local(v)) - (v - n.dot(v) * n)).norm(), 1e-14);
  }
}

NeighbourOffset offset_between(const FaceFrame& i, const FaceFrame& j) {
  return {i, TangentBasis(i.n), j};
}

/// At random, with its neighbour no nearer than 0.5.
NeighbourOffset random_offset(Random& random) {
  const double angle = random.between(-3.0, 3.0);
  const double length = random.between(0.5, 2.0);
  return {{length * std::cos(angle), length * std::sin(angle)}, random.vector2()};
}

TEST(Weingarten, NeighbourOffsetIsSeenInTheFacesOwnBasis) {
  const FaceFrame i{{0.0, 1.0, 0.0}, {1.0, 1.0, 5.0}};  // e1 = x, e2 = −z
  const FaceFrame j{{0.1, 0.9, 0.2}, {3.0, 4.0, 9.0}};
  const NeighbourOffset offset = offset_between(i, j);
  EXPECT_EQ(offset.d, Eigen::Vector2d(2.0, -4.0));
  EXPECT_EQ(offset.n, Eigen::Vector2d(0.1, -0.2));
}

TEST(Weingarten, MismatchIsZeroForTheMapOfASphere) {
  // On a sphere of radius R around the origin normals differ by 1/R times the points.
  const double radius = 40.0;
  Random random(1);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d here = random.near_z(0.5);
    const Eigen::Vector3d there = random.near_z(0.5);
    const WeingartenMap map{1.0 / radius, 1.0 / radius, 0.0};
    EXPECT_LT(offset_between({here, radius * here}, {there, radius * there}).mismatch(map), 1e-28);
    EXPECT_DOUBLE_EQ(map.mean_curvature(), 1.0 / radius);
  }
}

TEST(Weingarten, MismatchOfAFlatMapIsTheSquaredBend) {
  const FaceFrame i{{0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}};
  const FaceFrame j{{0.3, 0.4, 0.8}, {2.0, 0.0, 0.0}};
  EXPECT_NEAR(offset_between(i, j).mismatch({}), 0.25 / 4.0, 1e-15);
}

TEST(Weingarten, MismatchSlopeEqualsCentralDifferences) {
  Random random(2);
  double worst = 0.0;
  for (int k = 0; k < 300; ++k) {
    const NeighbourOffset offset = random_offset(random);
    const WeingartenMap m{random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                          random.between(-1.0, 1.0)};
    const auto mismatch = [&](const Eigen::VectorXd& x) {
      return NeighbourOffset(x.head<2>(), x.tail<2>()).mismatch(m);
    };
    const MismatchSlope slope(offset, m);
    ASSERT_DOUBLE_EQ(slope.value, offset.mismatch(m));
    Eigen::VectorXd x(4);
    x << offset.d, offset.n;
    Eigen::VectorXd computed(4);
    computed << slope.by_d, slope.by_n;
    const double error = testing::plateau_error(computed, mismatch, x, 5e-4);
    ASSERT_LT(error, 1e-8);
    worst = std::max(worst, error);
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

TEST(Weingarten, WelschIsZeroAtRestAndSaturatesAtOne) {
  EXPECT_EQ(welsch(0.0, 0.3).value, 0.0);
  EXPECT_DOUBLE_EQ(welsch(0.0, 0.3).slope, 1.0 / (2.0 * 0.09));
  EXPECT_NEAR(welsch(2.0 * 0.09, 0.3).value, 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(welsch(100.0, 0.3).value, 1.0, 1e-15);
}

TEST(Weingarten, WelschSlopeEqualsCentralDifferences) {
  Random random(5);
  for (int k = 0; k < 100; ++k) {
    const double nu = random.magnitude(0.01, 10.0);
    const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, random.between(0.1, 3.0) * nu * nu);
    const auto f = [&](const Eigen::VectorXd& x) { return welsch(x[0], nu).value; };
    const Eigen::VectorXd slope = Eigen::VectorXd::Constant(1, welsch(h[0], nu).slope);
    EXPECT_LT(testing::plateau_error(slope, f, h, 1e-3 * nu * nu), 1e-9);
  }
}

TEST(Weingarten, WelschLiesBelowItsTangents) {
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const double nu = random.magnitude(0.01, 10.0);
    const double h0 = random.between(0.0, 6.0) * nu * nu;
    const double h = random.between(0.0, 6.0) * nu * nu;
    const ValueSlope tangent = welsch(h0, nu);
    EXPECT_LE(welsch(h, nu).value, tangent.value + tangent.slope * (h - h0) + 1e-15);
  }
}

TEST(FaceFit, SolvesAsEigenDoes) {
  testing::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    Eigen::Matrix3d root;
    for (double& x : root.reshaped()) x = random.between(-1.0, 1.0);
    const Eigen::Matrix3d matrix =
        root * root.transpose() + random.magnitude(1e-6, 1.0) * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d right = random.vector3();
    const Eigen::Vector3d expected = matrix.llt().solve(right);
    const double tolerance = 1e-9 * expected.norm();  // Condition numbers of up to 1e7.
    EXPECT_LT((solve_positive(matrix, right) - expected).norm(), tolerance) << matrix;
  }
}

TEST(FaceFit, FindsTheMapThatMadeTheOffsets) {
  testing::Random random(2);
  const WeingartenMap map{0.7, -0.4, 0.2};
  FaceFit fit;
  for (int k = 0; k < 3; ++k) {
    const FaceFrame here{{0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}};
    FaceFrame there = here;
    const Eigen::Vector2d d = random.vector2();
    there.c.head<2>() = d;
    there.n.head<2>() =
        Eigen::Vector2d(map.a * d.x() + map.c * d.y(), map.c * d.x() + map.b * d.y());
    fit.add(NeighbourOffset(here, TangentBasis(here.n), there), 1.0);
  }
  const WeingartenMap found = fit.solve();
  EXPECT_NEAR(found.a, map.a, 1e-7);
  EXPECT_NEAR(found.b, map.b, 1e-7);
  EXPECT_NEAR(found.c, map.c, 1e-7);
}

TEST(MeanCurvature, IsSquaredHalfTraceTimesArea) {
  const ValueSlope term = mean_curvature_term({0.2, 0.4, 7.0}, 5.0);
  EXPECT_DOUBLE_EQ(term.value, 0.09 * 5.0);
  EXPECT_DOUBLE_EQ(term.slope, 0.09);
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
      corners_.push_back(mesh.corners(t));
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
  /// Offset of face j from face i.
  [[nodiscard]] NeighbourOffset offset(std::size_t i, std::size_t j) const {
    return {frames_[i], TangentBasis(frames_[i].n), frames_[j]};
  }
  /// h of an inner edge.
  [[nodiscard]] double mismatch(std::int64_t t, int k) const {
    const auto i = static_cast<std::size_t>(t);
    const std::size_t j = neighbour(t, k);
    return offset(i, j).mismatch(maps_[i]) + offset(j, i).mismatch(maps_[j]);
  }
  void fit(std::int64_t t) {
    const auto i = static_cast<std::size_t>(t);
    Eigen::Matrix<double, 7, 3> rows = Eigen::Matrix<double, 7, 3>::Zero();
    Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
    for (int k = 0; k < 3; ++k) {
      if (topology_.neighbours(k, t) < 0) continue;
      const NeighbourOffset there = offset(i, neighbour(t, k));
      const double scale = std::sqrt(edge_weight_ * weights_(k, t)) / there.d.norm();
      rows.row(2 * k) = scale * Eigen::RowVector3d(there.d.x(), 0.0, there.d.y());
      rows.row(2 * k + 1) = scale * Eigen::RowVector3d(0.0, there.d.y(), there.d.x());
      right.segment<2>(2 * k) = scale * there.n;
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
    area += 0.5 * area_normal(mesh.corners(t)).norm();
  }
  const EnergyValues e = evaluate_at(objective, mesh.vertices).energy;
  EXPECT_NEAR(e.face * radius * radius / area, 1.0, 0.015);
  // Sum over 10,500 edges.
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

TEST(BendFace, SeveralAtATimeHaveTheBitsOfSingleFaces) {
  const Executor executor = Executor::serial();
  const SurfaceMesh mesh = rough_mesh();
  const MeshOn<Executor> arrays(mesh, make_topology(mesh), executor);
  const auto faces = static_cast<std::size_t>(mesh.triangle_count());
  std::vector<FaceFrame> frames(faces);
  std::vector<double> doubled_areas(faces);
  std::vector<double> edge_weights(3 * faces);
  std::vector<FaceBend> bends(faces);
  Random random(8);
  for (std::size_t i = 0; i < faces; ++i) {
    const Corners t = mesh.corners(static_cast<std::int64_t>(i));
    frames[i] = face_frame(t);
    doubled_areas[i] = area_normal(t).norm();
  }
  for (double& weight : edge_weights) weight = random.between(0.0, 200.0);
  const BendFace bend{{.weights = {},
                       .nu = 0.05,
                       .area = {},
                       .light = LightPath(kSetup),
                       .vertices = mesh.vertices.data(),
                       .incident = {},
                       .mesh = arrays.view(),
                       .goal = {},
                       .scratch = {frames.data(), doubled_areas.data(), nullptr, bends.data(),
                                   edge_weights.data(), nullptr, nullptr},
                       .aperture = {}}};
  const std::array<double, 2> sum =
      parallel_sum<2>(executor, "bend faces", mesh.triangle_count(), bend);
  const std::vector<FaceBend> expected = bends;
  for (const Lanes lanes : {Lanes::kTwo, widest_lanes()}) {
    for (FaceBend& each : bends) each.by_area = -1.0F;
    EXPECT_EQ(sum_in_lanes(executor, "bend faces", mesh.triangle_count(), bend, lanes).get(), sum);
    for (std::size_t i = 0; i < faces; ++i) {
      ASSERT_EQ(bends[i].by_area, expected[i].by_area);
      ASSERT_EQ(bends[i].by_tilt, expected[i].by_tilt);
      for (int k = 0; k < 3; ++k) {
        if (arrays.view().neighbour(static_cast<std::int64_t>(i), k) < 0) continue;
        ASSERT_EQ(bends[i].by_neighbours[k].n, expected[i].by_neighbours[k].n);
        ASSERT_EQ(bends[i].by_neighbours[k].c, expected[i].by_neighbours[k].c);
      }
    }
  }
}

const Eigen::Vector2d kPlate(12.0, 10.0);

/// E_lap of `vertices`; adds weight × its derivative to `gradient`.
double evaluate(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& vertices, double weight,
                Eigen::Matrix3Xd& gradient, const Executor& executor = Executor::serial()) {
  const MeshOn<Executor> arrays(mesh, make_topology(mesh), executor);
  Eigen::Matrix2Xd shares(2, vertices.cols());
  const LaplacianDistance distance{arrays.view(), vertices.data(), shares.data()};
  return laplacian_term(executor, distance, weight, gradient.data()).get()[0];
}

double value_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& vertices) {
  Eigen::Matrix3Xd ignored = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  return evaluate(mesh, vertices, 1.0, ignored);
}

TEST(LaplacianTerm, IsZeroWhereEveryVertexIsAmongItsNeighbours) {
  // The middle of a grid mesh is regular; an affine map keeps it so.
  SurfaceMesh mesh = make_grid_mesh(kPlate, {30, 9}, 5.0);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  evaluate(mesh, mesh.vertices, 1.0, gradient);
  EXPECT_LT(gradient.col(4 * 30 + 15).norm(), 1e-14);
}

TEST(LaplacianTerm, CountsADisplacedVertexAndItsNeighbours) {
  SurfaceMesh mesh = make_grid_mesh(kPlate, {30, 25}, 5.0);
  const double before = value_of(mesh, mesh.vertices);
  mesh.vertices(0, 12 * 30 + 15) += 0.1;
  // Six neighbours: the vertex is off by 0.1, each neighbour's mean by 0.1 / 6.
  EXPECT_NEAR(value_of(mesh, mesh.vertices) - before, 0.01 * (1.0 + 6.0 / 36.0), 1e-12);
}

TEST(LaplacianTerm, DoesNotSeeHeights) {
  SurfaceMesh mesh = make_grid_mesh(kPlate, {8, 7}, 5.0);
  const double before = value_of(mesh, mesh.vertices);
  mesh.vertices.row(2).setRandom();
  EXPECT_EQ(value_of(mesh, mesh.vertices), before);
}

TEST(LaplacianTerm, AdjointEqualsCentralDifferences) {
  Random random(1);
  SurfaceMesh mesh = make_grid_mesh(kPlate, {8, 7}, 5.0);
  for (double& x : mesh.vertices.reshaped()) x += 0.2 * random.between(-1.0, 1.0);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Constant(3, mesh.vertices.cols(), 2.0);
  evaluate(mesh, mesh.vertices, 0.4, gradient, Executor::cpu(2));
  const auto f = [&](const Eigen::VectorXd& x) {
    return 0.4 * value_of(mesh, x.reshaped(3, mesh.vertices.cols()));
  };
  const Eigen::VectorXd x = mesh.vertices.reshaped();
  const Eigen::VectorXd computed = gradient.reshaped().array() - 2.0;
  EXPECT_LT(testing::plateau_error(computed, f, x, 1e-2), 1e-9);
}

}  // namespace

}  // namespace lensforge
