// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/edge_split.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "design/reflect/mesh/edges.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

/// |e| times the angle between the normals beside an edge.
double bend(const SurfaceMesh& mesh, const Faces& faces, const Edge& e) {
  if (e.right < 0) return 0.0;
  const double cosine = faces.normal.col(e.left).dot(faces.normal.col(e.right));
  const double length = (mesh.vertices.col(e.to) - mesh.vertices.col(e.from)).norm();
  return length * std::acos(std::clamp(cosine, -1.0, 1.0));
}

std::vector<int> by_falling_value(const Eigen::VectorXd& value) {
  std::vector<int> order(static_cast<std::size_t>(value.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return value[a] > value[b]; });
  return order;
}

/// Whether two edges have a vertex in common.
bool touch(const Edge& a, const Edge& b) {
  return a.from == b.from || a.from == b.to || a.to == b.from || a.to == b.to;
}

/// The edge that mirrors each edge; itself where there is none.
std::vector<int> mirrored_edges(const EdgeTable& table, const std::vector<int>& partner) {
  std::map<std::pair<int, int>, int> number;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    number[{edge.from, edge.to}] = e;
  }
  std::vector<int> mirrored;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    const auto found = number.find(std::minmax(partner[static_cast<std::size_t>(edge.from)],
                                               partner[static_cast<std::size_t>(edge.to)]));
    mirrored.push_back(found == number.end() ? e : found->second);
  }
  return mirrored;
}

}  // namespace

Eigen::VectorXd split_criterion(const SurfaceMesh& mesh, const Eigen::VectorXd& energy_by_face) {
  const EdgeTable table = make_edges(mesh);
  const Faces faces = measure_faces(mesh);
  Eigen::VectorXd bends(table.count());
  for (int e = 0; e < table.count(); ++e) {
    bends[e] = bend(mesh, faces, table.edges[static_cast<std::size_t>(e)]);
  }
  Eigen::VectorXd criterion = Eigen::VectorXd::Zero(table.count());
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    if (edge.right < 0) continue;
    double around = -2.0 * bends[e];
    for (const int face : {edge.left, edge.right}) {
      for (int k = 0; k < 3; ++k) around += bends[table.of_face(k, face)];
    }
    criterion[e] = (energy_by_face[edge.left] + energy_by_face[edge.right]) * around;
  }
  return criterion;
}

std::vector<int> chosen_edges(const SurfaceMesh& mesh, const Eigen::VectorXd& criterion, int count,
                              const std::vector<int>& partner) {
  const EdgeTable table = make_edges(mesh);
  std::vector<int> mirrored;
  if (!partner.empty()) mirrored = mirrored_edges(table, partner);
  std::vector<std::uint8_t> taken(static_cast<std::size_t>(mesh.vertex_count()), 0);
  const auto edge = [&](int e) { return table.edges[static_cast<std::size_t>(e)]; };
  const auto is_free = [&](int e) {
    return taken[static_cast<std::size_t>(edge(e).from)] == 0 &&
           taken[static_cast<std::size_t>(edge(e).to)] == 0;
  };
  std::vector<int> chosen;
  for (const int e : by_falling_value(criterion)) {
    if (static_cast<int>(chosen.size()) >= count || !(criterion[e] > 0.0)) break;
    const int other = mirrored.empty() ? e : mirrored[static_cast<std::size_t>(e)];
    if (!is_free(e) || !is_free(other) || (other != e && touch(edge(e), edge(other)))) continue;
    for (const int one : {e, other}) {
      taken[static_cast<std::size_t>(edge(one).from)] = 1;
      taken[static_cast<std::size_t>(edge(one).to)] = 1;
    }
    chosen.push_back(e);
    if (other != e) chosen.push_back(other);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

SplitMesh split_at_middles(const SurfaceMesh& mesh, const std::vector<int>& edges) {
  const EdgeTable table = make_edges(mesh);
  const auto vertices = static_cast<int>(mesh.vertex_count());
  SplitMesh result{mesh, {}};
  result.mesh.vertices.conservativeResize(3, vertices + static_cast<Eigen::Index>(edges.size()));
  std::vector<Eigen::Vector3i> added;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& edge = table.edges[static_cast<std::size_t>(edges[i])];
    const int middle = vertices + static_cast<int>(i);
    result.mesh.vertices.col(middle) =
        0.5 * (mesh.vertices.col(edge.from) + mesh.vertices.col(edge.to));
    for (const int face : {edge.left, edge.right}) {
      if (face < 0) continue;
      int k = 0;
      while (table.of_face(k, face) != edges[i]) ++k;
      Eigen::Vector3i half = mesh.triangles.col(face);
      half[k] = middle;
      added.push_back(half);
      result.parent.push_back(face);
      result.mesh.triangles((k + 1) % 3, face) = middle;
    }
  }
  const Eigen::Index faces = mesh.triangle_count();
  result.mesh.triangles.conservativeResize(3, faces + static_cast<Eigen::Index>(added.size()));
  for (std::size_t i = 0; i < added.size(); ++i) {
    result.mesh.triangles.col(faces + static_cast<Eigen::Index>(i)) = added[i];
  }
  return result;
}

}  // namespace lensforge::reflect
