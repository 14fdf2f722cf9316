// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/energy/smoothness.h"
#include "design/finite_difference.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;

const Eigen::Vector2d kSize(12.0, 10.0);

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
  SurfaceMesh mesh = make_grid_mesh(kSize, {30, 9}, 5.0);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  evaluate(mesh, mesh.vertices, 1.0, gradient);
  EXPECT_LT(gradient.col(4 * 30 + 15).norm(), 1e-14);
}

TEST(LaplacianTerm, CountsADisplacedVertexAndItsNeighbours) {
  SurfaceMesh mesh = make_grid_mesh(kSize, {30, 25}, 5.0);
  const double before = value_of(mesh, mesh.vertices);
  mesh.vertices(0, 12 * 30 + 15) += 0.1;
  // Six neighbours: the vertex is off by 0.1, each neighbour's mean by 0.1 / 6.
  EXPECT_NEAR(value_of(mesh, mesh.vertices) - before, 0.01 * (1.0 + 6.0 / 36.0), 1e-12);
}

TEST(LaplacianTerm, DoesNotSeeHeights) {
  SurfaceMesh mesh = make_grid_mesh(kSize, {8, 7}, 5.0);
  const double before = value_of(mesh, mesh.vertices);
  mesh.vertices.row(2).setRandom();
  EXPECT_EQ(value_of(mesh, mesh.vertices), before);
}

TEST(LaplacianTerm, AdjointEqualsCentralDifferences) {
  Random random(1);
  SurfaceMesh mesh = make_grid_mesh(kSize, {8, 7}, 5.0);
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
