// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"

namespace lensforge {
namespace {

using lensforge::testing::grid_mesh;
using lensforge::testing::message_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

SurfaceMesh mesh_of(int vertices, const std::vector<std::array<int, 3>>& triangles) {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, vertices);
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto& corners = triangles[static_cast<std::size_t>(t)];
    mesh.triangles.col(t) << corners[0], corners[1], corners[2];
  }
  return mesh;
}

std::vector<int> list(const std::vector<std::int32_t>& begin,
                      const std::vector<std::int32_t>& values, std::size_t vertex) {
  return {values.begin() + begin[vertex], values.begin() + begin[vertex + 1]};
}

TEST(MeshTopology, TwoTrianglesKnowEachOther) {
  const MeshTopology topology = make_topology(mesh_of(4, {{0, 1, 2}, {3, 2, 1}}));
  EXPECT_THAT(topology.neighbours.reshaped(), ElementsAre(-1, 1, -1, -1, 0, -1));
  EXPECT_THAT(list(topology.vertex_corner_begin, topology.vertex_corners, 1), ElementsAre(1, 5));
  EXPECT_THAT(list(topology.vertex_corner_begin, topology.vertex_corners, 3), ElementsAre(3));
  EXPECT_THAT(list(topology.vertex_neighbour_begin, topology.vertex_neighbours, 0),
              ElementsAre(1, 2));
  EXPECT_THAT(list(topology.vertex_neighbour_begin, topology.vertex_neighbours, 2),
              ElementsAre(0, 1, 3));
  EXPECT_THAT(topology.on_boundary, ElementsAre(1, 1, 1, 1));
}

TEST(MeshTopology, OnlyTheRimOfAGridIsBoundary) {
  const SurfaceMesh mesh = grid_mesh(6, 4);
  const MeshTopology topology = make_topology(mesh);
  for (int v = 0; v < 24; ++v) {
    const bool rim = v % 6 == 0 || v % 6 == 5 || v < 6 || v >= 18;
    EXPECT_EQ(topology.on_boundary[static_cast<std::size_t>(v)], rim ? 1 : 0) << v;
  }
}

TEST(MeshTopology, AClosedMeshHasNoBoundary) {
  const MeshTopology topology =
      make_topology(mesh_of(4, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}));
  EXPECT_THAT(topology.on_boundary, ElementsAre(0, 0, 0, 0));
  EXPECT_GE(topology.neighbours.minCoeff(), 0);
}

/// Tables from a plain search over all pairs of edges.
void expect_agrees_with_search(const SurfaceMesh& mesh) {
  const MeshTopology topology = make_topology(mesh);
  std::map<std::pair<int, int>, int> triangle_of_edge;
  std::vector<std::set<int>> neighbours(static_cast<std::size_t>(mesh.vertex_count()));
  std::vector<std::vector<int>> corners(neighbours.size());
  for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int from = mesh.triangles(k, t);
      const int to = mesh.triangles((k + 1) % 3, t);
      triangle_of_edge[{from, to}] = t;
      neighbours[static_cast<std::size_t>(from)].insert(to);
      neighbours[static_cast<std::size_t>(to)].insert(from);
      corners[static_cast<std::size_t>(from)].push_back(3 * t + k);
    }
  }
  for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto across =
          triangle_of_edge.find({mesh.triangles((k + 1) % 3, t), mesh.triangles(k, t)});
      ASSERT_EQ(topology.neighbours(k, t), across == triangle_of_edge.end() ? -1 : across->second);
    }
  }
  for (std::size_t v = 0; v < neighbours.size(); ++v) {
    ASSERT_EQ(list(topology.vertex_corner_begin, topology.vertex_corners, v), corners[v]);
    ASSERT_EQ(list(topology.vertex_neighbour_begin, topology.vertex_neighbours, v),
              std::vector<int>(neighbours[v].begin(), neighbours[v].end()));
  }
}

TEST(MeshTopology, AgreesWithAPlainSearchForAnyOrderOfTrianglesAndCorners) {
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    SurfaceMesh mesh = grid_mesh(7, 5);
    std::vector<Eigen::Vector3i> columns;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      Eigen::Vector3i v = mesh.triangles.col(t);
      std::rotate(v.data(), v.data() + random() % 3, v.data() + 3);
      columns.push_back(v);
    }
    // Neighbours of what is already there come first, else fans would meet in a vertex only.
    std::rotate(columns.begin(), columns.begin() + 12 * (round % 2), columns.end());
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      mesh.triangles.col(t) = columns[static_cast<std::size_t>(t)];
    }
    expect_agrees_with_search(mesh);
  }
}

TEST(MeshTopology, TrianglesInRandomOrderAreFitted) {
  std::mt19937 random(6);
  for (int round = 0; round < 50; ++round) {
    SurfaceMesh mesh = grid_mesh(9, 8);
    for (Eigen::Index t = mesh.triangles.cols() - 1; t > 0; --t) {
      const auto other = static_cast<Eigen::Index>(random() % static_cast<unsigned>(t + 1));
      mesh.triangles.col(t).swap(mesh.triangles.col(other));
    }
    expect_agrees_with_search(mesh);
  }
}

TEST(MeshTopology, FansThatMeetInOneVertexAreBothListed) {
  const MeshTopology topology = make_topology(mesh_of(5, {{0, 1, 2}, {0, 3, 4}}));
  EXPECT_THAT(list(topology.vertex_neighbour_begin, topology.vertex_neighbours, 0),
              ElementsAre(1, 2, 3, 4));
}

TEST(MeshTopology, AVertexWithoutTrianglesHasEmptyLists) {
  const MeshTopology topology = make_topology(mesh_of(4, {{0, 1, 2}}));
  EXPECT_EQ(topology.vertex_corner_begin.size(), 5U);
  EXPECT_EQ(topology.vertex_corner_begin[3], topology.vertex_corner_begin[4]);
  EXPECT_EQ(topology.vertex_neighbour_begin[3], topology.vertex_neighbour_begin[4]);
}

TEST(MeshTopology, RefusesAnEdgeWithThreeTriangles) {
  const SurfaceMesh mesh = mesh_of(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  ::testing::internal::CaptureStderr();
  EXPECT_THAT(message_of<InputError>([&] { make_topology(mesh); }),
              HasSubstr("triangle 2 (vertices 0, 1, 4)"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(MeshTopology, RefusesATriangleTurnedAgainstItsNeighbour) {
  const SurfaceMesh mesh = mesh_of(4, {{0, 1, 2}, {1, 2, 3}});
  EXPECT_THAT(message_of<InputError>([&] { make_topology(mesh); }),
              HasSubstr("triangle 1 (vertices 1, 2, 3)"));
}

TEST(MeshTopology, RefusesATriangleThatUsesAVertexTwice) {
  const SurfaceMesh mesh = mesh_of(3, {{0, 1, 1}});
  EXPECT_THAT(message_of<InputError>([&] { make_topology(mesh); }), HasSubstr("a vertex twice"));
}

TEST(MeshTopology, RefusesAnIndexOutOfRange) {
  for (const int bad : {-1, 3}) {
    const SurfaceMesh mesh = mesh_of(3, {{0, 1, bad}});
    EXPECT_THAT(message_of<InputError>([&] { make_topology(mesh); }),
                HasSubstr("uses a vertex outside 0 ... 2"));
  }
}

}  // namespace
}  // namespace lensforge
