// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/surface_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

std::optional<std::string> extent_fault(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  const double tolerance = kRimShare * size.maxCoeff();
  for (int axis = 0; axis < 2; ++axis) {
    const double low = mesh.vertices.row(axis).minCoeff();
    const double high = mesh.vertices.row(axis).maxCoeff();
    if (std::abs(low) <= tolerance && std::abs(high - size[axis]) <= tolerance) continue;
    return std::string(axis == 0 ? "x" : "y") + " runs from " + number_text(low) + " to " +
           number_text(high) + " mm: by lens_size it must run from 0 to " + number_text(size[axis]);
  }
  return std::nullopt;
}

/// The cell of a grid that a triangle lies in and the corner of it that it leaves out; −1 if it is
/// no half of a cell.
struct HalfCell {
  std::int64_t cell = -1;
  std::size_t left_out = 0;  ///< 0, 1 lower left and right, 2, 3 upper left and right.
};

HalfCell half_cell(const SurfaceMesh& mesh, const GridShape& shape, std::int64_t triangle) {
  const Eigen::Vector3i v = mesh.triangles.col(triangle);
  const Eigen::Vector3i row = v / shape.columns;
  const Eigen::Vector3i column = v - row * shape.columns;
  const Eigen::Vector2i low(column.minCoeff(), row.minCoeff());
  if (column.maxCoeff() != low.x() + 1 || row.maxCoeff() != low.y() + 1) return {};
  std::array<bool, 4> has{};
  for (int k = 0; k < 3; ++k) {
    const int quarter = column[k] - low.x() + 2 * (row[k] - low.y());
    has[static_cast<std::size_t>(quarter)] = true;
  }
  if (std::count(has.begin(), has.end(), true) != 3) return {};
  return {std::int64_t{low.y()} * (shape.columns - 1) + low.x(),
          static_cast<std::size_t>(std::find(has.begin(), has.end(), false) - has.begin())};
}

/// A side of the rim: its first control point, the step to the next, and their number.
struct RimSide {
  Eigen::Index first;
  Eigen::Index step;
  int count;
  int axis;  ///< The coordinate that all of them share.
  double at;
};

}  // namespace

std::optional<std::string> surface_fault(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (mesh.plan_area(t) > 0.0) continue;
    return "triangle " + std::to_string(t) +
           " must run counter-clockwise seen from +z, but covers " +
           number_text(mesh.plan_area(t)) + " mm^2";
  }
  const double lowest = mesh.vertices.row(2).minCoeff();
  const double highest = mesh.vertices.row(2).maxCoeff();
  const LightPath light(setup);
  const auto vertices = mesh.vertices.colwise();
  const bool before_screen = std::all_of(vertices.begin(), vertices.end(),
                                         [&](const auto& p) { return light.before_screen(p); });
  if (!(lowest >= 0.0 && before_screen)) {
    return "z runs from " + number_text(lowest) + " to " + number_text(highest) +
           " mm: must be between the entry face at 0 and the receiving plane" +
           (setup.screen_is_turned() ? "" : " at " + number_text(setup.focal_length));
  }
  return extent_fault(mesh, setup.lens_size);
}

std::optional<std::string> spline_fault(const ControlNet& net, const OpticalSetup& setup) {
  const int columns = net.shape.columns;
  const int rows = net.shape.rows;
  for (const RimSide& side :
       {RimSide{0, columns, rows, 0, 0.0},
        RimSide{columns - 1, columns, rows, 0, setup.lens_size.x()}, RimSide{0, 1, columns, 1, 0.0},
        RimSide{Eigen::Index{rows - 1} * columns, 1, columns, 1, setup.lens_size.y()}}) {
    for (int k = 0; k < side.count; ++k) {
      const Eigen::Index point = side.first + side.step * k;
      const double found = net.points(side.axis, point);
      if (found == side.at) continue;
      return "control point " + std::to_string(point) + " on the rim has " +
             (side.axis == 0 ? "x " : "y ") + number_text(found) + ": by lens_size it must be " +
             number_text(side.at);
    }
  }
  return surface_fault(spline_nodes(net, kMeshSamples).mesh, setup);
}

std::optional<std::string> grid_fault(const SurfaceMesh& mesh, const GridShape& shape) {
  const std::int64_t cells = std::int64_t{shape.columns - 1} * (shape.rows - 1);
  if (mesh.triangle_count() != 2 * cells) {
    return "the surface has " + std::to_string(mesh.triangle_count()) +
           " triangles, the grid calls for " + std::to_string(2 * cells);
  }
  constexpr std::size_t kNone = 4;
  constexpr std::size_t kFull = 5;
  std::vector<std::size_t> left_out(static_cast<std::size_t>(cells), kNone);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const HalfCell half = half_cell(mesh, shape, t);
    if (half.cell < 0)
      return "the surface's triangle " + std::to_string(t) + " is no half of a cell of the grid";
    std::size_t& other = left_out[static_cast<std::size_t>(half.cell)];
    // The halves of a cell leave out opposite corners: 0 and 3, or 1 and 2.
    if (other != kNone && other + half.left_out != 3) {
      return "the surface's triangle " + std::to_string(t) + " overlaps another one in its cell";
    }
    other = other == kNone ? half.left_out : kFull;
  }
  return std::nullopt;
}

namespace {

// The number of times a mesh covers a point can change only at an edge with more triangles on one
// side than on the other. If all triangles face up and all such edges lie on the rectangle's rim,
// every point inside is covered equally often; and once, if the triangles' areas sum to the
// rectangle's.

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
