// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/shape/shape_update.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "design/reflect/mesh/faces.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

ShapeUpdateOptions options_for(ElementKind kind, int iterations = 200) {
  ShapeUpdateOptions options;
  options.elements = kind;
  options.max_iterations = iterations;
  options.tolerance = 1e-12;
  return options;
}

double largest_move(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return std::sqrt((a - b).colwise().squaredNorm().maxCoeff());
}

class EveryElement : public ::testing::TestWithParam<ElementKind> {};

INSTANTIATE_TEST_SUITE_P(ShapeUpdate, EveryElement,
                         ::testing::Values(ElementKind::kRimSpoke, ElementKind::kFace));

TEST_P(EveryElement, OwnNormalsLeaveTheShapeAsItIs) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  const ShapeUpdate update(mesh, {}, options_for(GetParam(), 5));
  const Eigen::Matrix3Xd moved =
      update.moved(mesh.vertices, measure_faces(mesh).normal, Executor::serial());
  EXPECT_LT(largest_move(moved, mesh.vertices), GetParam() == ElementKind::kFace ? 1e-7 : 0.01);
}

TEST_P(EveryElement, TurnedNormalsTurnTheShape) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const ShapeUpdate update(mesh, {}, options_for(GetParam(), 400));
  const Eigen::Matrix3Xd moved =
      update.moved(mesh.vertices, turn * measure_faces(mesh).normal, Executor::serial());
  EXPECT_LT(largest_move(moved, turn * mesh.vertices), 2e-3);
}

TEST_P(EveryElement, EnergyNeverRises) {
  const SurfaceMesh mesh = shapes::torus(16, 10);
  Eigen::Matrix3Xd targets = measure_faces(mesh).normal;
  targets.row(2).array() += 0.3;
  targets.colwise().normalize();
  const ShapeUpdate update(mesh, {}, options_for(GetParam(), 1));
  Eigen::Matrix3Xd vertices = mesh.vertices;
  double energy = update.energy(vertices, targets, Executor::serial());
  const double first = energy;
  for (int i = 0; i < 20; ++i) {
    vertices = update.moved(vertices, targets, Executor::serial());
    const double next = update.energy(vertices, targets, Executor::serial());
    EXPECT_LE(next, energy * (1.0 + 1e-9));
    energy = next;
  }
  EXPECT_LT(energy, first);
}

TEST_P(EveryElement, FixedVerticesStayAndThePiecesMeanToo) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  Eigen::Matrix3Xd targets = measure_faces(mesh).normal;
  targets.row(2).array() += 0.3;
  targets.colwise().normalize();
  const ShapeUpdate free(mesh, {}, options_for(GetParam(), 20));
  const Eigen::Matrix3Xd moved = free.moved(mesh.vertices, targets, Executor::serial());
  EXPECT_GT(largest_move(moved, mesh.vertices), 0.01);
  EXPECT_LT((moved.rowwise().mean() - mesh.vertices.rowwise().mean()).norm(), 1e-6);
  std::vector<std::uint8_t> fixed(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (std::size_t v = 0; v < fixed.size(); v += 7) fixed[v] = 1;
  const ShapeUpdate held(mesh, fixed, options_for(GetParam(), 20));
  const Eigen::Matrix3Xd kept = held.moved(mesh.vertices, targets, Executor::serial());
  for (std::size_t v = 0; v < fixed.size(); v += 7) {
    const auto at = static_cast<Eigen::Index>(v);
    EXPECT_EQ(kept.col(at), mesh.vertices.col(at));
  }
}

TEST(ShapeUpdate, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  Eigen::Matrix3Xd targets = measure_faces(mesh).normal;
  targets.row(0).array() += 0.2;
  targets.colwise().normalize();
  const ShapeUpdate update(mesh, {}, options_for(ElementKind::kFace, 10));
  EXPECT_EQ(update.moved(mesh.vertices, targets, Executor::serial()),
            update.moved(mesh.vertices, targets, Executor::cpu(2)));
}

}  // namespace
}  // namespace lensforge::reflect
