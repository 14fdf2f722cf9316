// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/contact_features.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <utility>

#include "cam/contact/ball_cutter.h"

namespace lensforge {
namespace {

/// A ridge this flat (rad) counts as a seam: rolling over it lifts the ball by R·(1e-8)²/8.
constexpr double kFlatRidge = 1e-8;

/// One side of an edge: the triangle and which of its edges it is.
struct HalfEdge {
  std::int32_t far_vertex = 0;  ///< The edge's larger vertex number.
  std::int32_t corner = 0;      ///< 3·triangle + edge.
};

/// Half-edges grouped by the smaller vertex of their edge, in the order of the triangles.
struct EdgeTable {
  std::vector<std::int64_t> begin;
  std::vector<HalfEdge> halves;
};

std::pair<int, int> edge_vertices(const SurfaceMesh& mesh, std::int64_t triangle, int k) {
  return std::minmax(int{mesh.triangles(k, triangle)}, int{mesh.triangles((k + 1) % 3, triangle)});
}

EdgeTable group_edges(const SurfaceMesh& mesh) {
  EdgeTable table;
  table.begin.assign(static_cast<std::size_t>(mesh.vertex_count()) + 1, 0);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++table.begin[static_cast<std::size_t>(edge_vertices(mesh, t, k).first) + 1];
    }
  }
  for (std::size_t v = 1; v < table.begin.size(); ++v) table.begin[v] += table.begin[v - 1];
  std::vector<std::int64_t> next(table.begin.begin(), table.begin.end() - 1);
  table.halves.resize(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [near, far] = edge_vertices(mesh, t, k);
      const auto place = static_cast<std::size_t>(next[static_cast<std::size_t>(near)]++);
      table.halves[place] = {far, static_cast<std::int32_t>(3 * t + k)};
    }
  }
  return table;
}

/// A triangle as seen from one of its edges: e0 → e1 and the corner across.
struct Wing {
  Eigen::Vector3d e0, e1, apex;
  Eigen::Vector3d normal;  ///< Unit, upwards.
  bool judged = false;     ///< Neither thin nor steep.
};

Wing make_wing(const SurfaceMesh& mesh, std::int32_t corner) {
  const std::int64_t t = corner / 3;
  const int k = corner % 3;
  Wing wing{mesh.corner(t, k), mesh.corner(t, (k + 1) % 3), mesh.corner(t, (k + 2) % 3), {}, false};
  const Eigen::Vector3d cross = (wing.e0 - wing.apex).cross(wing.e1 - wing.apex);
  const double area2 = cross.norm();
  const double side2 =
      std::max({(wing.e1 - wing.e0).squaredNorm(), (wing.e0 - wing.apex).squaredNorm(),
                (wing.e1 - wing.apex).squaredNorm()});
  if (!(area2 >= kRegularFacet * side2) || !(area2 > 0.0)) return wing;
  wing.normal = (cross.z() < 0.0 ? -cross : cross) / area2;
  wing.judged = wing.normal.z() >= kRegularFacet;
  return wing;
}

double side_of_edge(const Wing& edge, const Eigen::Vector3d& point) {
  const Eigen::Vector3d u = edge.e1 - edge.e0;
  const Eigen::Vector3d w = point - edge.e0;
  return u.x() * w.y() - u.y() * w.x();
}

/// True if the two triangles lie on either side of their edge, seen from above, and meet in a
/// valley or a flat seam: no plane through the edge has both below it.
bool is_valley(const Wing& left, const Wing& right) {
  if (!left.judged || !right.judged) return false;
  if (side_of_edge(left, left.apex) * side_of_edge(left, right.apex) >= 0.0) return false;
  const Eigen::Vector3d u = left.e1 - left.e0;
  const Eigen::Vector3d w = right.apex - left.e0;
  const double reach = u.cross(w).norm() / u.norm();
  return left.normal.dot(w) > -kFlatRidge * reach;
}

/// One of the half-edges begin … end − 1 of a table with the same far vertex as half-edge i, and
/// how many there are; `end` and 0 if there is none.
std::pair<std::size_t, int> partner(const EdgeTable& table, std::size_t i, std::size_t begin,
                                    std::size_t end) {
  std::pair<std::size_t, int> found{end, 0};
  for (std::size_t j = begin; j < end; ++j) {
    if (j == i || table.halves[j].far_vertex != table.halves[i].far_vertex) continue;
    found = {j, found.second + 1};
  }
  return found;
}

/// Marks the half-edges that have to be tried among those whose smaller vertex is v.
struct KeepEdges {
  const SurfaceMesh& mesh;
  const EdgeTable& table;
  std::vector<std::uint8_t>& kept;  ///< One a half-edge, 3·triangle + k.

  void operator()(std::int64_t v) const {
    const auto begin = static_cast<std::size_t>(table.begin[static_cast<std::size_t>(v)]);
    const auto end = static_cast<std::size_t>(table.begin[static_cast<std::size_t>(v) + 1]);
    for (std::size_t i = begin; i < end; ++i) {
      const HalfEdge& half = table.halves[i];
      if (half.far_vertex == v || partner(table, i, begin, i).second > 0) continue;
      const auto [other, count] = partner(table, i, begin, end);
      const bool valley = count == 1 && is_valley(make_wing(mesh, half.corner),
                                                  make_wing(mesh, table.halves[other].corner));
      if (!valley) kept[static_cast<std::size_t>(half.corner)] = 1;
    }
  }
};

}  // namespace

std::vector<ContactFeatures> contact_features(const SurfaceMesh& mesh, const Executor& executor) {
  const auto triangles = static_cast<std::size_t>(mesh.triangle_count());
  const EdgeTable table = group_edges(mesh);
  std::vector<std::uint8_t> kept(3 * triangles, 0);
  parallel_for(executor, "contact features", mesh.vertex_count(), KeepEdges{mesh, table, kept});

  std::vector<ContactFeatures> features(triangles, 0);
  std::vector<bool> owned(static_cast<std::size_t>(mesh.vertex_count()), false);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(k);
      const auto v = static_cast<std::size_t>(mesh.triangles(k, static_cast<std::int64_t>(t)));
      if (kept[3 * t + corner] != 0) features[t] |= edge_bit(k);
      if (!owned[v]) features[t] |= corner_bit(k);
      owned[v] = true;
    }
  }
  return features;
}

}  // namespace lensforge
