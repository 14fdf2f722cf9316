// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Adjacency of a triangle mesh, as flat arrays for the kernels.
struct MeshTopology {
  /// 3 × T: triangle across edge k of a triangle (edge k runs from corner k to corner k+1 mod 3);
  /// −1 at the boundary.
  Eigen::Matrix3Xi neighbours;
  /// Corners around vertex v are vertex_corners[vertex_corner_begin[v] … vertex_corner_begin[v+1]),
  /// each as 3·triangle + k, ascending.
  std::vector<std::int32_t> vertex_corner_begin;
  std::vector<std::int32_t> vertex_corners;
  /// Vertices that share an edge with vertex v, in the same compressed form, ascending.
  std::vector<std::int32_t> vertex_neighbour_begin;
  std::vector<std::int32_t> vertex_neighbours;
  /// 1 for a vertex on the mesh's boundary, else 0.
  std::vector<std::uint8_t> on_boundary;
};

/// Builds the tables through OpenMesh.
/// @throw InputError if the mesh is not a manifold (an edge with three triangles, a triangle
///        oriented against its neighbour).
MeshTopology make_topology(const SurfaceMesh& mesh);

}  // namespace lensforge
