// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "design/reflect/mesh/faces.h"
#include "design/reflect/shape/shape_update.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

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
