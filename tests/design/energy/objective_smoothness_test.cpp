// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>
#include <vector>

#include "design/energy/objective.h"
#include "design/objective_setups.h"

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
  /// Of face j from face i.
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

}  // namespace
}  // namespace lensforge
