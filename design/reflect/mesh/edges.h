// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// An edge between two vertices and the faces beside it.
struct Edge {
  int from = 0;  ///< The smaller vertex number.
  int to = 0;
  int left = -1;   ///< A face that uses the edge.
  int right = -1;  ///< The other one; −1 at the boundary.
};

/// All edges of a mesh.
struct EdgeTable {
  std::vector<Edge> edges;   ///< By their vertices, ascending.
  Eigen::Matrix3Xi of_face;  ///< 3 × F: edge k runs from corner k to corner k+1 mod 3.
  int crowded = -1;          ///< An edge with more than two faces; −1 if there is none.

  [[nodiscard]] int count() const { return static_cast<int>(edges.size()); }
  [[nodiscard]] bool is_closed() const;
  /// The face across edge k of a face; −1 at the boundary.
  [[nodiscard]] int across(Eigen::Index face, int k) const;
};

EdgeTable make_edges(const SurfaceMesh& mesh);

/// The cotangents of a triangle's angles, that of edge k (from corner k to k+1) opposite to it; a
/// triangle without area has zeros.
Eigen::Vector3d cotangents(const Corners& corners);

}  // namespace lensforge::reflect
