// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/height_field_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "core/surface/mesh_normals.h"
#include "core/text/number_text.h"

// The number of times a mesh covers a point can change only at an edge with more triangles on one
// side than on the other. If all triangles face up and all such edges lie on the rectangle's rim,
// every point inside is covered equally often; and once, if the triangles' areas sum to the
// rectangle's.
namespace lensforge {
namespace {

std::string millimetres(double value) { return decimal_text(value, 4); }

/// One number for all vertices at the same point.
std::vector<int> places_of(const SurfaceMesh& mesh) {
  const auto key = [&](int v) {
    const auto p = mesh.vertices.col(v);
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::vector<int> order(static_cast<std::size_t>(mesh.vertex_count()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  std::vector<int> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    place[static_cast<std::size_t>(order[i])] =
        same ? place[static_cast<std::size_t>(order[i - 1])] : order[i];
  }
  return place;
}

/// An edge from the vertex of the smaller number to the other, or (−1) back.
struct DirectedEdge {
  int low;
  int high;
  int direction;

  [[nodiscard]] std::pair<int, int> ends() const { return {low, high}; }
};

std::vector<DirectedEdge> sorted_edges(const SurfaceMesh& mesh) {
  const std::vector<int> place = places_of(mesh);
  std::vector<DirectedEdge> edges;
  edges.reserve(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int from = place[static_cast<std::size_t>(mesh.triangles(k, t))];
      const int to = place[static_cast<std::size_t>(mesh.triangles((k + 1) % 3, t))];
      if (from != to) edges.push_back({std::min(from, to), std::max(from, to), from < to ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const DirectedEdge& a, const DirectedEdge& b) { return a.ends() < b.ends(); });
  return edges;
}

/// True if both ends lie on the same side of the rectangle.
bool on_rim(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& size) {
  for (int axis = 0; axis < 2; ++axis) {
    for (const double side : {0.0, size[axis]}) {
      const bool a_is = std::abs(a[axis] - side) <= kRimDistance;
      if (a_is && std::abs(b[axis] - side) <= kRimDistance) return true;
    }
  }
  return false;
}

/// An edge off the rim where the mesh has a border or covers one side more often than the other.
std::optional<Eigen::Vector2d> stray_border(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  const std::vector<DirectedEdge> edges = sorted_edges(mesh);
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    int balance = 0;
    while (end < edges.size() && edges[end].ends() == edges[begin].ends()) {
      balance += edges[end++].direction;
    }
    const Eigen::Vector2d a = mesh.vertices.col(edges[begin].low).head<2>();
    const Eigen::Vector2d b = mesh.vertices.col(edges[begin].high).head<2>();
    if (balance != 0 && !on_rim(a, b, size)) return 0.5 * (a + b);
    begin = end;
  }
  return std::nullopt;
}

/// Area seen from above, or the number of a triangle without area.
struct PlanArea {
  double area = 0.0;
  std::int64_t bad = -1;
};

PlanArea plan_area(const SurfaceMesh& mesh) {
  PlanArea sum;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = area_normal(mesh, t);
    if (normal.isZero(0.0)) continue;
    if (!(normal.z() > 0.0)) return {0.0, t};
    sum.area += 0.5 * normal.z();
  }
  return sum;
}

std::optional<std::string> box_fault(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  Eigen::AlignedBox2d box;
  for (const int v : mesh.triangles.reshaped()) box.extend(mesh.vertices.col(v).head<2>());
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(box.min()[axis]) <= kRimDistance &&
        std::abs(box.max()[axis] - size[axis]) <= kRimDistance) {
      continue;
    }
    return "spans " + std::string(axis == 0 ? "x " : "y ") + millimetres(box.min()[axis]) + " to " +
           millimetres(box.max()[axis]) + " mm, not 0 to " + millimetres(size[axis]) +
           " mm as the lens does";
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> height_field_fault(const SurfaceMesh& mesh,
                                              const Eigen::Vector2d& size) {
  if (mesh.triangle_count() == 0) return "has no triangles";
  if (!mesh.vertices.allFinite()) return "has a vertex that is not finite";
  const PlanArea sum = plan_area(mesh);
  if (sum.bad >= 0) {
    return "is no height field, triangle " + std::to_string(sum.bad) +
           " is vertical or turned over";
  }
  if (auto fault = box_fault(mesh, size)) return fault;
  if (const auto place = stray_border(mesh, size)) {
    return "is no height field over the lens, it has a hole or an overlap at x " +
           decimal_text(place->x(), 2) + " y " + decimal_text(place->y(), 2) + " mm";
  }
  if (std::abs(sum.area - size.prod()) > 2.0 * kRimDistance * size.sum()) {
    return "is no height field over the lens, its triangles cover " + millimetres(sum.area) +
           " of " + millimetres(size.prod()) + " mm2";
  }
  return std::nullopt;
}

}  // namespace lensforge
