// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/faces.h"

#include <gmock/gmock.h>

#include <set>

#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

Eigen::VectorXd criterion_of(const SurfaceMesh& mesh) {
  return split_criterion(mesh, measure_faces(mesh).area);
}

TEST(EdgeSplit, IsTheSameSurfaceAndStaysAManifold) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  const std::vector<int> edges = chosen_edges(mesh, criterion_of(mesh), 30, {});
  const SplitMesh cut = split_at_middles(mesh, edges);
  EXPECT_EQ(edges.size(), 30U);
  EXPECT_EQ(cut.mesh.triangle_count(), mesh.triangle_count() + 60);
  EXPECT_NEAR(measure_faces(cut.mesh).area.sum(), measure_faces(mesh).area.sum(), 1e-12);
  EXPECT_NEAR(signed_volume(cut.mesh), signed_volume(mesh), 1e-12);
  const EdgeTable table = make_edges(cut.mesh);
  EXPECT_TRUE(table.is_closed());
  EXPECT_LT(table.crowded, 0);
}

TEST(EdgeSplit, ChosenEdgesShareNoVertex) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  const EdgeTable table = make_edges(mesh);
  std::set<int> vertices;
  const std::vector<int> edges = chosen_edges(mesh, criterion_of(mesh), 1000, {});
  for (const int e : edges) {
    vertices.insert(table.edges[static_cast<std::size_t>(e)].from);
    vertices.insert(table.edges[static_cast<std::size_t>(e)].to);
  }
  EXPECT_EQ(vertices.size(), 2 * edges.size());
}

TEST(EdgeSplit, AFlatPlateHasNothingToSplit) {
  const SurfaceMesh mesh = shapes::trihedral(4);
  const Eigen::VectorXd criterion = criterion_of(mesh);
  EXPECT_EQ(criterion.cwiseAbs().maxCoeff(), 0.0);  // The plates meet without common vertices.
  EXPECT_THAT(chosen_edges(mesh, criterion, 10, {}), ::testing::IsEmpty());
}

TEST(EdgeSplit, SymmetricMeshesStaySymmetric) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  const std::vector<int> edges =
      chosen_edges(mesh, criterion_of(mesh), 60, mirror_partners(mesh, 0));
  EXPECT_NO_THROW(mirror_partners(split_at_middles(mesh, edges).mesh, 0));
}

}  // namespace
}  // namespace lensforge::reflect
