// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/reflect/input.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/shape/normals.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

TEST(FixedSteps, AFaceThatHasLostItsAreaKeepsANormal) {
  SurfaceMesh mesh = shapes::icosphere(1);
  const Eigen::Matrix3Xd reference = measure_faces(mesh).normal;
  mesh.vertices.col(mesh.triangles(1, 0)) = mesh.vertices.col(mesh.triangles(0, 0));
  const Eigen::VectorXd share = measure_faces(mesh).area_share();
  ASSERT_EQ(share.minCoeff(), 0.0);
  const PathEstimator estimator(mesh, make_light_field(ReflectOptions{}), Loss::kSquare,
                                Executor::cpu(2));
  const Eigen::Matrix3Xd normals =
      stepped_normals(estimator, {reference, 0.1}, share, reference, 8, 1);
  EXPECT_LT((normals.colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace lensforge::reflect
