// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/mesh_evening.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/mesh/mesh_topology.h"

namespace lensforge {
namespace {

/// Sweeps at most over the vertices of small triangles alone, of which interpolated meshes took 8.
/// Then all vertices move, which ends in a mesh without folds (Tutte 1963).
constexpr int kMostSweeps = 50;

using Marks = std::vector<char>;

Marks all_vertices(const SurfaceMesh& mesh) {
  return Marks(static_cast<std::size_t>(mesh.vertex_count()), 1);
}

Marks vertices_of_small_triangles(const SurfaceMesh& mesh, double least) {
  Marks marks(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    if (!(mesh.plan_area(f) < least)) continue;
    for (const int v : mesh.triangles.col(f)) marks[static_cast<std::size_t>(v)] = 1;
  }
  return marks;
}

class Evening {
 public:
  explicit Evening(SurfaceMesh& mesh) : mesh_(mesh), topology_(make_topology(mesh)) {}

  void sweep(const Marks& marks) {
    const Eigen::Matrix3Xd before = mesh_.vertices;
    for (int v = 0; v < static_cast<int>(before.cols()); ++v) {
      if (marks[static_cast<std::size_t>(v)] != 0) mesh_.vertices.col(v) = middle(before, v);
    }
  }

 private:
  /// Mean of the neighbours, of those on the same border if there is one; a corner stays.
  [[nodiscard]] Eigen::Vector3d middle(const Eigen::Matrix3Xd& vertices, int v) const {
    const auto [columns, rows] = mesh_.grid;
    const bool keeps_x = v % columns == 0 || v % columns == columns - 1;
    const bool keeps_y = v / columns == 0 || v / columns == rows - 1;
    if (keeps_x && keeps_y) return vertices.col(v);
    Eigen::Vector3d sum(0.0, 0.0, 0.0);
    int count = 0;
    const auto begin = topology_.vertex_neighbour_begin.begin() + v;
    for (int i = begin[0]; i < begin[1]; ++i) {
      const int other = topology_.vertex_neighbours[static_cast<std::size_t>(i)];
      if (keeps_x && other % columns != v % columns) continue;
      if (keeps_y && other / columns != v / columns) continue;
      sum += vertices.col(other);
      ++count;
    }
    return sum / count;
  }

  SurfaceMesh& mesh_;
  MeshTopology topology_;
};

}  // namespace

void even_out(double least, SurfaceMesh& mesh) {
  Evening evening(mesh);
  for (int sweep = 0; sweep < kEveningSweeps; ++sweep) evening.sweep(all_vertices(mesh));
  for (int sweep = 0;; ++sweep) {
    const Marks small = vertices_of_small_triangles(mesh, least);
    if (std::find(small.begin(), small.end(), 1) == small.end()) return;
    evening.sweep(sweep < kMostSweeps ? small : all_vertices(mesh));
  }
}

}  // namespace lensforge
