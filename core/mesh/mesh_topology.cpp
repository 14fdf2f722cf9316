// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_topology.h"

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "core/error.h"

namespace lensforge {
namespace {

using OpenMesh::TriConnectivity;

/// Keeps OpenMesh from printing while it lives; errors are reported by exceptions instead.
class OpenMeshSilence {
 public:
  OpenMeshSilence() { omerr().disable(), omout().disable(), omlog().disable(); }
  ~OpenMeshSilence() { omerr().enable(), omout().enable(), omlog().enable(); }
  OpenMeshSilence(const OpenMeshSilence&) = delete;
  OpenMeshSilence& operator=(const OpenMeshSilence&) = delete;
};

std::string described(const SurfaceMesh& mesh, int triangle) {
  const Eigen::Vector3i v = mesh.triangles.col(triangle);
  return "triangle " + std::to_string(triangle) + " (vertices " + std::to_string(v.x()) + ", " +
         std::to_string(v.y()) + ", " + std::to_string(v.z()) + ")";
}

void check_corners(const SurfaceMesh& mesh, int triangle) {
  const Eigen::Vector3i v = mesh.triangles.col(triangle);
  if (v.minCoeff() < 0 || v.maxCoeff() >= mesh.vertex_count()) {
    throw InputError("mesh: " + described(mesh, triangle) + " uses a vertex outside 0 ... " +
                     std::to_string(mesh.vertex_count() - 1));
  }
  if (v.x() == v.y() || v.y() == v.z() || v.z() == v.x()) {
    throw InputError("mesh: " + described(mesh, triangle) + " uses a vertex twice");
  }
}

/// OpenMesh's half-edges for `mesh`, faces and vertices numbered as in it.
TriConnectivity make_connectivity(const SurfaceMesh& mesh) {
  const OpenMeshSilence silence;
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  const auto triangles = static_cast<std::size_t>(mesh.triangle_count());
  TriConnectivity connectivity;
  connectivity.reserve(vertices, vertices + triangles, triangles);
  for (std::size_t v = 0; v < vertices; ++v) connectivity.new_vertex();
  for (int t = 0; t < static_cast<int>(triangles); ++t) {
    check_corners(mesh, t);
    const Eigen::Vector3i v = mesh.triangles.col(t);
    const auto face =
        connectivity.add_face(OpenMesh::VertexHandle(v.x()), OpenMesh::VertexHandle(v.y()),
                              OpenMesh::VertexHandle(v.z()));
    if (!face.is_valid()) {
      throw InputError(
          "mesh: " + described(mesh, t) +
          " contradicts the triangles before it: an edge has more than two triangles or "
          "the triangle is turned against its neighbour");
    }
  }
  return connectivity;
}

/// Calls visit(k, half-edge) for edges k = 0, 1, 2 of a triangle. OpenMesh may start at any edge;
/// the corner at which an edge starts gives its number.
template <class Visit>
void for_each_edge(const TriConnectivity& connectivity, const SurfaceMesh& mesh, int triangle,
                   const Visit& visit) {
  auto edge = connectivity.halfedge_handle(OpenMesh::FaceHandle(triangle));
  for (int walked = 0; walked < 3; ++walked) {
    const int from = connectivity.from_vertex_handle(edge).idx();
    int k = 0;
    while (mesh.triangles(k, triangle) != from) ++k;
    visit(k, edge);
    edge = connectivity.next_halfedge_handle(edge);
  }
}

Eigen::Matrix3Xi triangles_across(const TriConnectivity& connectivity, const SurfaceMesh& mesh) {
  Eigen::Matrix3Xi across(3, mesh.triangle_count());
  for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
    for_each_edge(connectivity, mesh, t, [&](int k, OpenMesh::HalfedgeHandle edge) {
      across(k, t) = connectivity.opposite_face_handle(edge).idx();
    });
  }
  return across;
}

/// Turns counts per vertex, stored one place late, into the start of each vertex's list.
void accumulate(std::vector<std::int32_t>& begin) {
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
}

void list_corners(const SurfaceMesh& mesh, MeshTopology& topology) {
  auto& begin = topology.vertex_corner_begin;
  begin.assign(static_cast<std::size_t>(mesh.vertex_count()) + 1, 0);
  for (const int v : mesh.triangles.reshaped()) ++begin[static_cast<std::size_t>(v) + 1];
  accumulate(begin);
  topology.vertex_corners.resize(static_cast<std::size_t>(mesh.triangles.size()));
  std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
  // Corners are visited in ascending order, so every list is ascending.
  std::int32_t corner = 0;
  for (const int v : mesh.triangles.reshaped()) {
    const std::int32_t place = next[static_cast<std::size_t>(v)]++;
    topology.vertex_corners[static_cast<std::size_t>(place)] = corner++;
  }
}

/// Uses the edges, since OpenMesh's walk around a vertex visits only one of two fans that touch in
/// it.
void list_neighbours(const TriConnectivity& connectivity, MeshTopology& topology) {
  auto& begin = topology.vertex_neighbour_begin;
  begin.assign(connectivity.n_vertices() + 1, 0);
  const auto edge_count = static_cast<int>(connectivity.n_halfedges());
  for (int h = 0; h < edge_count; ++h) {
    const auto from = connectivity.from_vertex_handle(OpenMesh::HalfedgeHandle(h));
    ++begin[static_cast<std::size_t>(from.idx()) + 1];
  }
  accumulate(begin);
  topology.vertex_neighbours.resize(static_cast<std::size_t>(edge_count));
  std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
  for (int h = 0; h < edge_count; ++h) {
    const OpenMesh::HalfedgeHandle edge(h);
    const auto from = static_cast<std::size_t>(connectivity.from_vertex_handle(edge).idx());
    const auto place = static_cast<std::size_t>(next[from]++);
    topology.vertex_neighbours[place] = connectivity.to_vertex_handle(edge).idx();
  }
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
    std::sort(topology.vertex_neighbours.begin() + begin[v],
              topology.vertex_neighbours.begin() + begin[v + 1]);
  }
}

std::vector<std::uint8_t> boundary_marks(const SurfaceMesh& mesh, const Eigen::Matrix3Xi& across) {
  std::vector<std::uint8_t> marks(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (Eigen::Index t = 0; t < across.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if (across(k, t) >= 0) continue;
      marks[static_cast<std::size_t>(mesh.triangles(k, t))] = 1;
      marks[static_cast<std::size_t>(mesh.triangles((k + 1) % 3, t))] = 1;
    }
  }
  return marks;
}

}  // namespace

MeshTopology make_topology(const SurfaceMesh& mesh) {
  const TriConnectivity connectivity = make_connectivity(mesh);
  MeshTopology topology;
  topology.neighbours = triangles_across(connectivity, mesh);
  list_corners(mesh, topology);
  list_neighbours(connectivity, topology);
  topology.on_boundary = boundary_marks(mesh, topology.neighbours);
  return topology;
}

}  // namespace lensforge
