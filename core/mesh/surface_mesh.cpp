// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/surface_mesh.h"

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/error.h"

namespace lensforge {

Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = area_normal(mesh, t);
    for (int k = 0; k < 3; ++k) normals.col(mesh.triangles(k, t)) += normal;
  }
  return normals;
}

SampledSurface make_samples(const GridShape& shape) {
  SampledSurface result;
  SurfaceMesh& mesh = result.mesh;
  mesh.grid = shape;
  mesh.vertices.resize(3, Eigen::Index{shape.columns} * shape.rows);
  mesh.triangles = grid_triangles(shape);
  result.normals.resize(3, mesh.vertices.cols());
  return result;
}

namespace {

/// Catmull–Rom weights of four equally spaced values for a point between the second and the third,
/// t = 0 … 1: C¹, exact for straight lines and parabolas.
std::array<double, 4> cubic_weights(double t) {
  return {0.5 * t * (-1.0 + t * (2.0 - t)), 1.0 + 0.5 * t * t * (-5.0 + 3.0 * t),
          0.5 * t * (1.0 + t * (4.0 - 3.0 * t)), 0.5 * t * t * (t - 1.0)};
}

/// Interpolates `value(i)`, i = 0 … last, at i + t, continued linearly beyond both ends.
/// @pre 0 ≤ i < last.
template <class Value>
auto interpolate_cubic(int i, double t, int last, const Value& value) -> decltype(value(i)) {
  using T = decltype(value(i));
  const std::array<double, 4> w = cubic_weights(t);
  const T b = value(i);
  const T c = value(i + 1);
  const T a = i > 0 ? value(i - 1) : T(2.0 * b - c);
  const T d = i + 2 <= last ? value(i + 2) : T(2.0 * c - b);
  return T(w[0] * a + w[1] * b + w[2] * c + w[3] * d);
}

/// Displacement (x, y from the flat position) and height of a grid surface at a flat position.
class GridField {
 public:
  GridField(const SurfaceMesh& mesh, const Eigen::Vector2d& size)
      : mesh_(mesh), flat_(make_grid_mesh(size, mesh.grid, 0.0)), size_(size) {}

  [[nodiscard]] Eigen::Vector3d at(double x, double y) const {
    const int cells_y = mesh_.grid.rows - 1;
    const double v = y / size_.y() * cells_y;
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, cells_y - 1);
    return interpolate_cubic(row, v - row, cells_y, [&](int r) { return along_row(r, x); });
  }

 private:
  [[nodiscard]] Eigen::Vector3d along_row(int row, double x) const {
    const int cells_x = mesh_.grid.columns - 1;
    const RowPosition p = locate_in_row(x / size_.x() * cells_x, row, cells_x);
    return interpolate_cubic(p.column, p.fraction, cells_x, [&](int column) -> Eigen::Vector3d {
      const Eigen::Index i = static_cast<Eigen::Index>(row) * mesh_.grid.columns + column;
      return mesh_.vertices.col(i) - flat_.vertices.col(i);
    });
  }

  const SurfaceMesh& mesh_;
  SurfaceMesh flat_;
  Eigen::Vector2d size_;
};

}  // namespace

SurfaceMesh make_grid_mesh(const Eigen::Vector2d& size, const GridShape& shape, double z) {
  SurfaceMesh mesh;
  mesh.grid = shape;
  const int cells_x = shape.columns - 1;
  const int cells_y = shape.rows - 1;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(shape.columns) * shape.rows);
  mesh.triangles.resize(3, 2 * static_cast<Eigen::Index>(cells_x) * cells_y);
  Eigen::Index v = 0;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      mesh.vertices.col(v++) = Eigen::Vector3d(size.x() * (rest_column(c, r, cells_x) / cells_x),
                                               size.y() * (static_cast<double>(r) / cells_y), z);
    }
  }
  Eigen::Index t = 0;
  for (int r = 0; r < cells_y; ++r) {
    for (int c = 0; c < cells_x; ++c) {
      const int a = r * shape.columns + c;
      const int b = a + 1;
      const int d = a + shape.columns;
      const int e = d + 1;
      // The shorter diagonal: against the shift of the odd row.
      const bool even = r % 2 == 0;
      mesh.triangles.col(t++) = even ? Eigen::Vector3i(a, b, d) : Eigen::Vector3i(a, b, e);
      mesh.triangles.col(t++) = even ? Eigen::Vector3i(b, e, d) : Eigen::Vector3i(a, e, d);
    }
  }
  return mesh;
}

SurfaceMesh regrid(const SurfaceMesh& mesh, const Eigen::Vector2d& size, const GridShape& shape) {
  const GridField field(mesh, size);
  SurfaceMesh result = make_grid_mesh(size, shape, 0.0);
  for (Eigen::Index v = 0; v < result.vertices.cols(); ++v) {
    const Eigen::Index column = v % shape.columns;
    const Eigen::Index row = v / shape.columns;
    const Eigen::Vector3d flat = result.vertices.col(v);
    result.vertices.col(v) += field.at(flat.x(), flat.y());
    if (column == 0 || column == shape.columns - 1) result.vertices(0, v) = flat.x();
    if (row == 0 || row == shape.rows - 1) result.vertices(1, v) = flat.y();
  }
  return result;
}

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
