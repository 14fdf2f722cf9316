// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/input.h"

#include <gmock/gmock.h>

#include <numeric>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/temp_folder.h"
#include "design/reflect/mesh/faces.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using ::testing::HasSubstr;

/// A mesh whose faces share no vertices, as in STL.
SurfaceMesh soup(const SurfaceMesh& mesh) {
  SurfaceMesh result{Eigen::Matrix3Xd(3, 3 * mesh.triangle_count()), mesh.triangles, {}};
  for (int i = 0; i < 3 * mesh.triangle_count(); ++i) {
    result.vertices.col(i) = mesh.corner(i / 3, i % 3);
    result.triangles(i % 3, i / 3) = i;
  }
  return result;
}

std::string refusal(const SurfaceMesh& mesh) {
  try {
    repair_mesh(mesh, "m.stl");
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(MeshRepair, MergesVerticesInTheSamePlace) {
  const RepairedMesh repaired = repair_mesh(soup(shapes::icosphere(2)), "m");
  EXPECT_EQ(repaired.mesh.vertex_count(), 162);
  EXPECT_TRUE(repaired.closed);
  EXPECT_THAT(repaired.changes, ::testing::ElementsAre("798 duplicate vertices merged"));
}

TEST(MeshRepair, TurnsFacesOutwards) {
  SurfaceMesh mesh = shapes::icosphere(2);
  const double volume = signed_volume(mesh);
  for (int k = 0; k < mesh.triangle_count(); k += 3) {
    std::swap(mesh.triangles(0, k), mesh.triangles(1, k));
  }
  EXPECT_DOUBLE_EQ(signed_volume(repair_mesh(mesh, "m").mesh), volume);
  mesh.triangles.row(0).swap(mesh.triangles.row(1));
  EXPECT_DOUBLE_EQ(signed_volume(repair_mesh(mesh, "m").mesh), volume);
}

TEST(MeshRepair, KeepsAGoodMeshAsItIs) {
  for (const shapes::NamedShape& shape : shapes::drawn_shapes()) {
    const SurfaceMesh mesh = shape.draw();
    const RepairedMesh repaired = repair_mesh(mesh, shape.name);
    EXPECT_THAT(repaired.changes, ::testing::IsEmpty()) << shape.name;
    EXPECT_TRUE(repaired.closed) << shape.name;
    EXPECT_GT(signed_volume(mesh), 0.0) << shape.name;
    EXPECT_EQ(repaired.mesh.triangles, mesh.triangles) << shape.name;
  }
}

TEST(MeshRepair, DropsAFaceThatHasACornerTwice) {
  const SurfaceMesh good = shapes::icosphere(1);
  SurfaceMesh mesh = good;
  mesh.triangles.conservativeResize(3, good.triangle_count() + 1);
  mesh.triangles.col(good.triangle_count()) << 1, 2, 2;
  const RepairedMesh repaired = repair_mesh(mesh, "m.stl");
  EXPECT_EQ(repaired.mesh.triangles, good.triangles);
  EXPECT_TRUE(repaired.closed);
  EXPECT_THAT(repaired.changes, ::testing::ElementsAre("1 face without area removed"));
}

/// A mesh with flat faces on some of its edges: the middle of an edge becomes a vertex of the face
/// on one side, and the other side is closed with a face whose corners are collinear.
SurfaceMesh with_flat_faces(const SurfaceMesh& mesh, const std::vector<int>& edges) {
  const EdgeTable table = make_edges(mesh);
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v)
    vertices.emplace_back(mesh.vertices.col(v));
  for (Eigen::Index f = 0; f < mesh.triangle_count(); ++f)
    faces.emplace_back(mesh.triangles.col(f));
  for (const int e : edges) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    const auto middle = static_cast<int>(vertices.size());
    vertices.emplace_back(0.5 * (mesh.vertices.col(edge.from) + mesh.vertices.col(edge.to)));
    Eigen::Vector3i& face = faces[static_cast<std::size_t>(edge.left)];
    int k = 0;
    while (face[k] == edge.from || face[k] == edge.to) ++k;
    const int from = face[(k + 1) % 3];
    const int to = face[(k + 2) % 3];
    const int apex = face[k];
    face << from, middle, apex;
    faces.emplace_back(middle, to, apex);
    faces.emplace_back(from, to, middle);
  }
  SurfaceMesh result{
      Eigen::Matrix3Xd(3, std::ssize(vertices)), Eigen::Matrix3Xi(3, std::ssize(faces)), {}};
  for (Eigen::Index v = 0; v < result.vertex_count(); ++v) {
    result.vertices.col(v) = vertices[static_cast<std::size_t>(v)];
  }
  for (Eigen::Index f = 0; f < result.triangle_count(); ++f) {
    result.triangles.col(f) = faces[static_cast<std::size_t>(f)];
  }
  return result;
}

TEST(MeshRepair, FlatFacesLeaveNoCrack) {
  const SurfaceMesh good = shapes::octahedron();
  for (const std::vector<int>& edges : {std::vector<int>{0}, {0, 5, 9}, {2, 11}}) {
    const SurfaceMesh mesh = with_flat_faces(good, edges);
    ASSERT_TRUE(make_edges(mesh).is_closed());
    const RepairedMesh repaired = repair_mesh(mesh, "m.stl");
    EXPECT_TRUE(repaired.closed);
    EXPECT_EQ(repaired.mesh.triangle_count(), 8 + 2 * std::ssize(edges));
    EXPECT_GT(measure_faces(repaired.mesh).area.minCoeff(), 0.01);
    EXPECT_NEAR(signed_volume(repaired.mesh), signed_volume(good), 1e-12);
    EXPECT_THAT(repaired.changes,
                ::testing::ElementsAre(edges.size() == 1 ? "1 face without area removed"
                                                         : std::to_string(edges.size()) +
                                                               " faces without area removed"));
  }
}

TEST(MeshRepair, EveryFaceKnowsTheFaceThatItIsPartOf) {
  const SurfaceMesh good = shapes::octahedron();
  const SurfaceMesh mesh = with_flat_faces(good, {0, 5});
  const RepairedMesh repaired = repair_mesh(mesh, "m.stl");
  ASSERT_EQ(std::ssize(repaired.face), repaired.mesh.triangle_count());
  for (Eigen::Index f = 0; f < repaired.mesh.triangle_count(); ++f) {
    const int part_of = repaired.face[static_cast<std::size_t>(f)];
    EXPECT_NEAR(
        area_normal(repaired.mesh, f).normalized().dot(area_normal(mesh, part_of).normalized()),
        1.0, 1e-12);
  }
}

TEST(MeshRepair, RefusesAMeshWithoutAnyArea) {
  SurfaceMesh mesh = shapes::icosphere(1);
  mesh.vertices.bottomRows<2>().setZero();
  EXPECT_THAT(refusal(mesh), HasSubstr("m.stl: no face has an area"));
}

TEST(MeshRepair, RefusesAnEdgeWithThreeFaces) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 5);
  mesh.vertices << 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1;
  mesh.triangles.resize(3, 3);
  mesh.triangles << 0, 0, 0, 1, 1, 1, 2, 3, 4;
  EXPECT_THAT(refusal(mesh),
              AllOf(HasSubstr("the edge from 0,0,0 to 1,0,0 has more than two faces"),
                    HasSubstr("--faces N")));
}

/// Cubes of side 1 at these corners, with common vertices.
SurfaceMesh unit_cubes(const std::vector<Eigen::Vector3d>& corners) {
  const SurfaceMesh cube = shapes::cube(1);
  SurfaceMesh mesh;
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Index vertices = mesh.vertices.cols();
    const Eigen::Index faces = mesh.triangles.cols();
    mesh.vertices.conservativeResize(3, vertices + cube.vertex_count());
    mesh.triangles.conservativeResize(3, faces + cube.triangle_count());
    mesh.vertices.rightCols(cube.vertex_count()) =
        (0.5 * (cube.vertices.array() + 1.0)).matrix().colwise() + corner;
    mesh.triangles.rightCols(cube.triangle_count()) =
        cube.triangles.array() + static_cast<int>(vertices);
  }
  return mesh;
}

TEST(MeshRepair, SeparatesSolidsThatTouchAlongAnEdge) {
  // The last two share a side, the first two an edge; the third and the first touch in a corner.
  const SurfaceMesh mesh = unit_cubes({{0, 0, 0}, {1, 1, 0}, {1, 1, 1}});
  EXPECT_THAT(refusal(mesh), HasSubstr("more than two faces"));
  const RepairedMesh repaired = repair_mesh(mesh, "m.stl", true);
  EXPECT_TRUE(repaired.closed);
  EXPECT_LT(make_edges(repaired.mesh).crowded, 0);
  EXPECT_NEAR(signed_volume(repaired.mesh), 3.0, 1e-12);
  EXPECT_THAT(repaired.changes,
              ::testing::Contains("surfaces separated at edges with more than two faces"));
}

TEST(MeshRepair, SeparatesASolidThatTouchesItself) {
  // A ring of cubes around a hole that closes along one edge.
  const SurfaceMesh mesh =
      unit_cubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 1, 2}, {1, 1, 2}, {1, 1, 1}, {1, 1, 0}});
  const RepairedMesh repaired = repair_mesh(mesh, "m.stl", true);
  EXPECT_TRUE(repaired.closed);
  EXPECT_LT(make_edges(repaired.mesh).crowded, 0);
  EXPECT_NEAR(signed_volume(repaired.mesh), 7.0, 1e-12);
}

TEST(MeshRepair, RefusesAMoebiusStrip) {
  SurfaceMesh mesh;
  constexpr int kSteps = 12;
  mesh.vertices.resize(3, 2 * kSteps);
  mesh.triangles.resize(3, 2 * kSteps);
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2.0 * 3.141592653589793 * i / kSteps;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d side =
        0.3 * (std::cos(angle / 2) * out + std::sin(angle / 2) * Eigen::Vector3d::UnitZ());
    mesh.vertices.col(2 * i) = out - side;
    mesh.vertices.col(2 * i + 1) = out + side;
    const bool last = i == kSteps - 1;
    const int a = last ? 1 : 2 * i + 2;
    const int b = last ? 0 : 2 * i + 3;
    mesh.triangles.col(2 * i) << 2 * i, a, b;
    mesh.triangles.col(2 * i + 1) << 2 * i, b, 2 * i + 1;
  }
  EXPECT_THAT(refusal(mesh), HasSubstr("one side only"));
}

TEST(Faces, QuarteredMeshIsTheSameSurface) {
  const SurfaceMesh mesh = shapes::torus(12, 8);
  const SurfaceMesh fine = quartered(mesh);
  EXPECT_EQ(fine.triangle_count(), 4 * mesh.triangle_count());
  EXPECT_NEAR(signed_volume(fine), signed_volume(mesh), 1e-12);
  EXPECT_NEAR(measure_faces(fine).area.sum(), measure_faces(mesh).area.sum(), 1e-12);
  EXPECT_TRUE(make_edges(fine).is_closed());
}

using ::testing::StartsWith;
using testing::TempFolder;

std::string refusal(const SurfaceMesh& mesh, const ReflectOptions& options) {
  try {
    prepared_input(mesh, "m.stl", options);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

int fixed_count(const ReflectOptions& options) {
  const ReflectInput input = prepared_input(shapes::icosphere(2), "m.stl", options);
  return std::accumulate(input.fixed.begin(), input.fixed.end(), 0);
}

TEST(ReflectInput, BoxPlaneAndFileHoldVertices) {
  ReflectOptions options;
  EXPECT_EQ(fixed_count(options), 0);
  options.fix_plane = "0,0,1,0";
  const int below = fixed_count(options);
  EXPECT_GT(below, 70);
  EXPECT_LT(below, 100);
  options.fix_plane = "";
  options.fix_box = "-2,-2,0.9,2,2,2";
  EXPECT_GT(fixed_count(options), 0);
  EXPECT_LT(fixed_count(options), below);
  const TempFolder folder;
  testing::write_bytes(folder / "v.txt", "0 1\n5\n");
  options.fix_box = "";
  options.fix_vertices = (folder / "v.txt").string();
  EXPECT_EQ(fixed_count(options), 3);
}

TEST(ReflectInput, RefusesWhatContradictsItself) {
  ReflectOptions options;
  options.fix_box = "-2,-2,-2,2,2,2";
  EXPECT_THAT(refusal(shapes::icosphere(2), options), HasSubstr("hold all 162 vertices"));
  options.fix_box = "1,2";
  EXPECT_THAT(refusal(shapes::icosphere(2), options),
              StartsWith("--fix-box 1,2: must be 6 finite numbers"));
  options = {};
  options.keep_volume = true;
  EXPECT_THAT(refusal(shapes::trihedral(2), options), StartsWith("--keep-volume: m.stl is open"));
  options = {};
  options.min_thickness = 1.0;
  EXPECT_THAT(refusal(shapes::trihedral(2), options), StartsWith("--min-thickness: m.stl is open"));
  options = {};
  options.symmetry = Symmetry::kX;
  EXPECT_THAT(refusal(shapes::dihedral(2.0, 2, 2), options), HasSubstr("has no mirror image"));
}

TEST(ReflectInput, RemeshingLeavesNoFaceWithoutArea) {
  ReflectOptions options;
  options.faces = 400;  // Far fewer than the rocket's creases need.
  const ReflectInput input = prepared_input(shapes::rocket(), "rocket", options);
  const Eigen::VectorXd area = measure_faces(input.mesh).area;
  EXPECT_GT(area.minCoeff(), 0.005 * area.mean());
  EXPECT_TRUE(input.closed);
}

TEST(ReflectInput, RefusesNumbersThatTheMeshDoesNotHave) {
  const TempFolder folder;
  ReflectOptions options;
  options.fix_vertices = (folder / "v.txt").string();
  for (const char* text : {"162", "-1", "1.5", "a", ""}) {
    testing::write_bytes(folder / "v.txt", text);
    EXPECT_NE(refusal(shapes::icosphere(2), options), "") << text;
  }
  options.faces = 500;
  EXPECT_THAT(refusal(shapes::icosphere(2), options), HasSubstr("--faces makes another mesh"));
}

TEST(ReflectInput, RemeshesToAboutTheFacesAskedFor) {
  ReflectOptions options;
  options.faces = 1000;
  const SurfaceMesh touching = unit_cubes({{0, 0, 0}, {1, 1, 0}});
  for (const auto& [mesh, loss] :
       {std::pair(shapes::icosphere(4), 0.02), std::pair(shapes::cube(4), 0.01),
        std::pair(shapes::animal(), 0.05), std::pair(shapes::rocket(), 0.07),
        std::pair(touching, 0.01)}) {
    const ReflectInput input = prepared_input(mesh, "m", options);
    EXPECT_NEAR(static_cast<double>(input.mesh.triangle_count()), 1000.0, 50.0);
    EXPECT_TRUE(make_edges(input.mesh).is_closed());
    const Eigen::VectorXd area = measure_faces(input.mesh).area;
    EXPECT_GT(area.minCoeff(), 0.005 * area.mean());
    EXPECT_NEAR(signed_volume(input.mesh), signed_volume(mesh), loss * signed_volume(mesh));
  }
}

}  // namespace

}  // namespace lensforge::reflect
