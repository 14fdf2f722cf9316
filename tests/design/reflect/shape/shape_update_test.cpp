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

Eigen::Matrix3Xd enforced(const SurfaceMesh& mesh, const ConstraintSet& set,
                          const Eigen::Matrix3Xd& vertices) {
  const Constraints constraints(mesh, set, Executor::cpu(2));
  const Eigen::Matrix3Xd result = constraints.enforced(vertices);
  EXPECT_THAT(constraints.broken(result), ::testing::IsEmpty());
  return result;
}

TEST(Constraints, KeepTheVolume) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  ConstraintSet set;
  set.volume = true;
  const Eigen::Matrix3Xd squashed = Eigen::Vector3d(1.0, 0.9, 0.8).asDiagonal() * mesh.vertices;
  EXPECT_THAT(Constraints(mesh, set, Executor::serial()).broken(squashed), ::testing::SizeIs(1));
  const SurfaceMesh kept{enforced(mesh, set, squashed), mesh.triangles, {}};
  EXPECT_NEAR(signed_volume(kept), signed_volume(mesh), 1e-6);
}

TEST(Constraints, KeepTheBoxAndTheLargestDisplacement) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  ConstraintSet set;
  set.box = true;
  set.max_displacement = 0.05;
  const Eigen::Matrix3Xd kept = enforced(mesh, set, 1.3 * mesh.vertices);
  EXPECT_LE((kept - mesh.vertices).colwise().norm().maxCoeff(), 0.05 + 1e-12);
  EXPECT_LE(kept.maxCoeff(), mesh.vertices.maxCoeff() + 1e-12);
}

TEST(Constraints, KeepFacesPlanar) {
  const SurfaceMesh mesh = shapes::trihedral(4);
  ConstraintSet set;
  set.planar.resize(1);
  for (int k = 0; k < 32; ++k) set.planar[0].push_back(k);  // The plate in z = 0.
  Eigen::Matrix3Xd bent = mesh.vertices;
  bent.row(2) += 0.1 * bent.row(0).cwiseAbs2();
  const Eigen::Matrix3Xd kept = enforced(mesh, set, bent);
  const SurfaceMesh flat{kept, mesh.triangles, {}};
  const Faces faces = measure_faces(flat);
  for (int k = 1; k < 32; ++k) EXPECT_NEAR(faces.normal.col(k).dot(faces.normal.col(0)), 1.0, 1e-9);
}

TEST(Constraints, KeepMaterialBehindVertices) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  ConstraintSet set;
  set.min_thickness = 1.5;
  Eigen::Matrix3Xd flat = mesh.vertices;
  flat.row(2) *= 0.73;
  const Eigen::Matrix3Xd kept = enforced(mesh, set, flat);
  EXPECT_GT(kept.row(2).maxCoeff() - kept.row(2).minCoeff(), 1.48);
}

TEST(Constraints, FacesThatAreTurnedOverAreNamedWithoutAnyConstraint) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  const Constraints constraints(mesh, {}, Executor::serial());
  EXPECT_THAT(constraints.broken(mesh.vertices), ::testing::IsEmpty());
  const Eigen::Matrix3Xd mirrored = Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal() * mesh.vertices;
  EXPECT_THAT(constraints.broken(mirrored),
              ::testing::ElementsAre(::testing::HasSubstr("% of the area are turned over")));
}

TEST(Constraints, KeepBothHalvesMirrorImages) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  ConstraintSet set;
  set.partner = mirror_partners(mesh, 0);
  Eigen::Matrix3Xd bent = mesh.vertices;
  bent.row(2) += 0.1 * bent.row(0);
  const Eigen::Matrix3Xd kept = enforced(mesh, set, bent);
  for (std::size_t v = 0; v < set.partner.size(); ++v) {
    const Eigen::Vector3d a = kept.col(static_cast<Eigen::Index>(v));
    const Eigen::Vector3d b = kept.col(set.partner[v]);
    EXPECT_NEAR((a - Eigen::Vector3d(-b.x(), b.y(), b.z())).norm(), 0.0, 1e-12);
  }
}

}  // namespace

}  // namespace lensforge::reflect
