// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/edges.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace lensforge::reflect {
namespace {

/// A face's side.
struct Side {
  int from;
  int to;
  int face;
  int k;
};

std::vector<Side> sorted_sides(const SurfaceMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (int face = 0; face < mesh.triangle_count(); ++face) {
    for (int k = 0; k < 3; ++k) {
      const auto [from, to] =
          std::minmax({mesh.triangles(k, face), mesh.triangles((k + 1) % 3, face)});
      sides.push_back({from, to, face, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.from, a.to, a.face, a.k) < std::tie(b.from, b.to, b.face, b.k);
  });
  return sides;
}

}  // namespace

bool EdgeTable::is_closed() const {
  return std::all_of(edges.begin(), edges.end(), [](const Edge& e) { return e.right >= 0; });
}

int EdgeTable::across(Eigen::Index face, int k) const {
  const Edge& edge = edges[static_cast<std::size_t>(of_face(k, face))];
  return edge.left == face ? edge.right : edge.left;
}

EdgeTable make_edges(const SurfaceMesh& mesh) {
  EdgeTable table;
  table.of_face.resize(3, mesh.triangle_count());
  for (const Side& side : sorted_sides(mesh)) {
    const bool known = !table.edges.empty() && table.edges.back().from == side.from &&
                       table.edges.back().to == side.to;
    if (!known) {
      table.edges.push_back({side.from, side.to, side.face, -1});
    } else if (table.edges.back().right < 0) {
      table.edges.back().right = side.face;
    } else {
      table.crowded = table.count() - 1;
    }
    table.of_face(side.k, side.face) = table.count() - 1;
  }
  return table;
}

Eigen::Vector3d cotangents(const Corners& corners) {
  const double twice_area = area_normal(corners).norm();
  if (!(twice_area > 0.0)) return Eigen::Vector3d::Zero();
  const std::array p{corners.v0, corners.v1, corners.v2};
  Eigen::Vector3d cotangent;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& apex = p[(k + 2) % 3];
    cotangent[static_cast<Eigen::Index>(k)] = (p[k] - apex).dot(p[(k + 1) % 3] - apex) / twice_area;
  }
  return cotangent;
}

}  // namespace lensforge::reflect
