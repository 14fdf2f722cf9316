// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "design/graded_mesh.h"
#include "design/test_setups.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

using testing::face_gradients;
using testing::graded_mesh;
using testing::Random;

const Eigen::Vector2d kSize(30.0, 24.0);
constexpr GridShape kShape{31, 29};
constexpr GridShape kSmallShape{9, 8};

HeightFitOptions thorough() {
  HeightFitOptions options;
  options.tolerance = 1e-13;
  return options;
}

Eigen::Matrix2Xd random_gradients(const SurfaceMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix2Xd gradients(2, mesh.triangle_count());
  for (double& g : gradients.reshaped()) g = random.between(-0.3, 0.3);
  return gradients;
}

double paraboloid(double x, double y) {
  return 5.0 + 2e-3 * std::pow(x - 11.0, 2) - 1e-3 * (x + 3.0) * y + 3e-3 * y * y;
}

/// A flat surface at the same x, y and mean height.
SurfaceMesh flattened(SurfaceMesh mesh) {
  mesh.vertices.row(2).setConstant(mesh.vertices.row(2).mean());
  return mesh;
}

struct MeshKind {
  std::string name;
  SurfaceMesh mesh;

  friend std::ostream& operator<<(std::ostream& out, const MeshKind& k) { return out << k.name; }
};

class HeightFitMeshes : public ::testing::TestWithParam<MeshKind> {
 protected:
  /// Largest error of the heights that come from the surface's own gradients.
  double error_of_recovery(const SurfaceMesh& surface) {
    SurfaceMesh mesh = flattened(surface);
    const HeightFitSummary summary =
        fit_face_gradients(face_gradients(surface), thorough(), Executor::serial(), mesh);
    EXPECT_TRUE(summary.converged);
    EXPECT_LE(summary.residual, thorough().tolerance);
    RecordProperty("iterations", summary.iterations);
    EXPECT_EQ(mesh.vertices.topRows<2>(), surface.vertices.topRows<2>());
    return (mesh.vertices - surface.vertices).cwiseAbs().maxCoeff();
  }

  SurfaceMesh mesh_ = GetParam().mesh;
};

INSTANTIATE_TEST_SUITE_P(
    HeightFit, HeightFitMeshes,
    ::testing::Values(MeshKind{"Even", make_grid_mesh(kSize, kShape, 5.0)},
                      MeshKind{"Graded", graded_mesh(kSize, kShape, 0.0, 1)},
                      MeshKind{"GradedAndRough", graded_mesh(kSize, kShape, 0.15, 2)}),
    [](const ::testing::TestParamInfo<MeshKind>& kind) { return kind.param.name; });

TEST_P(HeightFitMeshes, AParaboloidComesBack) {
  for (Eigen::Index v = 0; v < mesh_.vertices.cols(); ++v) {
    mesh_.vertices(2, v) = paraboloid(mesh_.vertices(0, v), mesh_.vertices(1, v));
  }
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, AnyPiecewiseLinearSurfaceComesBack) {
  Random random(3);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, ATiltedPlaneComesBack) {
  mesh_.vertices.row(2) += 0.1 * mesh_.vertices.row(0) - 0.05 * mesh_.vertices.row(1);
  EXPECT_LT(error_of_recovery(mesh_), 1e-10);
}

TEST_P(HeightFitMeshes, ASurfaceThatIsRightAlreadyStays) {
  Random random(4);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  SurfaceMesh mesh = mesh_;
  const HeightFitSummary summary =
      fit_face_gradients(face_gradients(mesh_), HeightFitOptions{}, Executor::serial(), mesh);
  EXPECT_TRUE(summary.converged);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_LT((mesh.vertices - mesh_.vertices).cwiseAbs().maxCoeff(), 1e-13);
}

TEST_P(HeightFitMeshes, NoGradientMakesASurfaceFlat) {
  Random random(5);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  const double mean = mesh_.vertices.row(2).mean();
  const HeightFitSummary summary =
      fit_face_gradients(Eigen::Matrix2Xd::Zero(2, mesh_.triangle_count()), HeightFitOptions{},
                         Executor::serial(), mesh_);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT((mesh_.vertices.row(2).array() - mean).abs().maxCoeff(), 1e-6);
}

TEST_P(HeightFitMeshes, AFlatSurfaceStaysFlatUnderGradientsOfRoundingSize) {
  const Eigen::Matrix2Xd gradients = 1e-16 * random_gradients(mesh_, 6);
  const HeightFitSummary summary =
      fit_face_gradients(gradients, HeightFitOptions{}, Executor::serial(), mesh_);
  RecordProperty("iterations", summary.iterations);
  EXPECT_TRUE(mesh_.vertices.allFinite());
  EXPECT_LT((mesh_.vertices.row(2).array() - 5.0).abs().maxCoeff(), 1e-12);
}

TEST_P(HeightFitMeshes, MeanHeightIsKept) {
  Random random(7);
  for (double& z : mesh_.vertices.row(2)) z += random.between(-0.2, 0.2);
  const double mean = mesh_.vertices.row(2).mean();
  fit_face_gradients(random_gradients(mesh_, 8), HeightFitOptions{}, Executor::serial(), mesh_);
  EXPECT_NEAR(mesh_.vertices.row(2).mean(), mean, 1e-12);
}

TEST_P(HeightFitMeshes, FewIterationsAreEnough) {
  SurfaceMesh mesh = mesh_;
  const HeightFitSummary summary =
      fit_face_gradients(random_gradients(mesh_, 9), HeightFitOptions{}, Executor::serial(), mesh);
  RecordProperty("iterations", summary.iterations);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT(summary.iterations, 60);
}

/// √A_i times the gradient of a triangle by the heights, two rows a triangle: by differences of
/// unit heights.
Eigen::MatrixXd dense_gradient_rows(SurfaceMesh mesh, const Eigen::VectorXd& root_areas) {
  Eigen::MatrixXd rows(2 * mesh.triangle_count(), mesh.vertex_count());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.row(2) = Eigen::RowVectorXd::Unit(mesh.vertices.cols(), v);
    const Eigen::Matrix2Xd weighted = face_gradients(mesh) * root_areas.asDiagonal();
    rows.col(v) = weighted.reshaped();
  }
  return rows;
}

TEST(HeightFit, ContradictoryGradientsGiveTheDenseLeastSquaresSolution) {
  for (const double jitter : {0.0, 0.2}) {
    SurfaceMesh mesh = graded_mesh(kSize, kSmallShape, jitter, 10);
    const Eigen::Matrix2Xd gradients = random_gradients(mesh, 11);
    const Eigen::VectorXd root_areas = testing::projected_areas(mesh).cwiseSqrt();
    const Eigen::MatrixXd rows = dense_gradient_rows(mesh, root_areas);
    const Eigen::Matrix2Xd weighted = gradients * root_areas.asDiagonal();
    const Eigen::VectorXd wanted = weighted.reshaped();
    // Of least norm, so of mean zero.
    const Eigen::VectorXd expected = rows.completeOrthogonalDecomposition().solve(wanted);
    ASSERT_NEAR(expected.mean(), 0.0, 1e-12);
    ASSERT_TRUE(fit_face_gradients(gradients, thorough(), Executor::serial(), mesh).converged);
    const Eigen::VectorXd heights = mesh.vertices.row(2).transpose().array() - 5.0;
    EXPECT_LT((heights - expected).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_LT((rows.transpose() * (rows * heights - wanted)).norm(), 1e-11 * wanted.norm());
    EXPECT_GT((rows * heights - wanted).norm(), 0.1 * wanted.norm());
  }
}

TEST(HeightFit, ReportsThatItHasNotConverged) {
  SurfaceMesh mesh = graded_mesh(kSize, kShape, 0.15, 12);
  HeightFitOptions options = thorough();
  options.max_iterations = 2;
  const HeightFitSummary summary =
      fit_face_gradients(random_gradients(mesh, 13), options, Executor::serial(), mesh);
  EXPECT_FALSE(summary.converged);
  EXPECT_EQ(summary.iterations, 2);
  EXPECT_GT(summary.residual, options.tolerance);
}

TEST(HeightFit, LeavesTheMeshAloneWhenAskedToStop) {
  const SurfaceMesh before = graded_mesh(kSize, kShape, 0.15, 14);
  SurfaceMesh mesh = before;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(fit_face_gradients(random_gradients(mesh, 15), HeightFitOptions{},
                                  Executor::cpu(2).with_stop(stop.get_token()), mesh),
               Interrupted);
  EXPECT_EQ(mesh.vertices, before.vertices);
}

TEST(HeightFit, ThreadCountDoesNotChangeABit) {
  // Above the executor's grain, so that the work is divided.
  SurfaceMesh serial = graded_mesh(kSize, {61, 57}, 0.15, 16);
  const SurfaceMesh start = serial;
  const Eigen::Matrix2Xd gradients = random_gradients(serial, 17);
  fit_face_gradients(gradients, HeightFitOptions{}, Executor::serial(), serial);
  for (const int threads : {1, 2}) {
    SurfaceMesh mesh = start;
    fit_face_gradients(gradients, HeightFitOptions{}, Executor::cpu(threads), mesh);
    EXPECT_EQ(mesh.vertices, serial.vertices);
  }
}

}  // namespace
}  // namespace lensforge
