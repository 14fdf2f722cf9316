// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/files/closed_solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/outline.h"

namespace lensforge {
namespace {

constexpr int kNone = -1;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(name + ": " + why);
}

Eigen::Vector2d flat(const SurfaceMesh& mesh, int vertex) {
  return mesh.vertices.col(vertex).head<2>();
}

Eigen::Vector2d middle(const SurfaceMesh& mesh) {
  const auto xy = mesh.vertices.topRows<2>();
  return 0.5 * (xy.rowwise().minCoeff() + xy.rowwise().maxCoeff());
}

void require_faces_up(const SurfaceMesh& surface, const std::string& name) {
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3i v = surface.triangles.col(t);
    const Eigen::Vector2d a = flat(surface, v[0]);
    if (cross(flat(surface, v[1]) - a, flat(surface, v[2]) - a) > 0.0) continue;
    refuse(name, "is no height field: triangle " + std::to_string(t) +
                     " is folded over, upright or turned down");
  }
}

void require_above_back(const SurfaceMesh& surface, const std::string& name) {
  const double lowest = surface.vertices.row(2).minCoeff();
  if (lowest > 0.0) return;
  refuse(name,
         "reaches down to z = " + std::to_string(lowest) + " mm: must be above the back, z = 0");
}

/// For every vertex of the outline the one that follows it, else kNone.
std::vector<int> successors(const SurfaceMesh& surface, const std::string& name) {
  const MeshTopology topology = make_topology(surface);
  std::vector<int> next(static_cast<std::size_t>(surface.vertex_count()), kNone);
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if (topology.neighbours(k, t) >= 0) continue;
      int& successor = next[static_cast<std::size_t>(surface.triangles(k, t))];
      if (successor != kNone) refuse(name, "has parts that touch in one point only");
      successor = surface.triangles((k + 1) % 3, t);
    }
  }
  return next;
}

std::vector<int> walk(const std::vector<int>& next, const std::string& name) {
  std::size_t count = 0;
  int first = kNone;
  for (std::size_t v = 0; v < next.size(); ++v) {
    if (next[v] == kNone) continue;
    if (first == kNone) first = static_cast<int>(v);
    ++count;
  }
  if (first == kNone) refuse(name, "has no outline: it must be an open surface");
  std::vector<int> loop{first};
  for (int v = next[static_cast<std::size_t>(first)]; v != first;
       v = next[static_cast<std::size_t>(v)]) {
    loop.push_back(v);
  }
  if (loop.size() != count) refuse(name, "has holes or several pieces");
  return loop;
}

/// True if the outline is star-shaped about the middle: triangles from there close its back.
bool is_seen_from_middle(const SurfaceMesh& surface, const std::vector<int>& loop) {
  const Eigen::Vector2d centre = middle(surface);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = flat(surface, loop[i]) - centre;
    const Eigen::Vector2d b = flat(surface, loop[(i + 1) % loop.size()]) - centre;
    if (!(cross(a, b) > 0.0)) return false;
  }
  return true;
}

double distance_to_side(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                        const Eigen::Vector2d& b) {
  const Eigen::Vector2d way = b - a;
  const double squared = way.squaredNorm();
  const double share = squared > 0.0 ? std::clamp(way.dot(p - a) / squared, 0.0, 1.0) : 0.0;
  return (p - (a + share * way)).norm();
}

/// Without corners on a straight way and spikes without width, but for rounding: where a mesh was
/// cut along its own edges, sides seem to touch.
std::vector<Eigen::Vector2d> straightened(std::vector<Eigen::Vector2d> points) {
  constexpr double kRounding = 1e-9;  // mm
  std::size_t count = 0;
  while (points.size() != count && points.size() > 3) {
    count = points.size();
    std::vector<Eigen::Vector2d> kept;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d& p = points[i];
      const Eigen::Vector2d& before = kept.empty() ? points.back() : kept.back();
      const Eigen::Vector2d& next = points[(i + 1) % count];
      const double off =
          std::min({distance_to_side(p, before, next), distance_to_side(next, before, p),
                    distance_to_side(before, p, next)});
      if (off > kRounding) kept.push_back(p);
    }
    points = std::move(kept);
  }
  return points;
}

/// Around an outline that crosses itself nowhere, triangles that all face up cover every point
/// inside once.
void require_simple(const SurfaceMesh& surface, const std::vector<int>& loop,
                    const std::string& name) {
  std::vector<Eigen::Vector2d> points;
  points.reserve(loop.size());
  for (const int v : loop) points.emplace_back(flat(surface, v));
  points = straightened(std::move(points));
  if (const auto fault = polygon_fault(points)) refuse(name, "has a bad outline: " + *fault);
}

/// With a back of triangles around its middle. @pre is_seen_from_middle().
SurfaceMesh solid_around_middle(const SurfaceMesh& surface, const std::vector<int>& loop) {
  const auto around = static_cast<int>(loop.size());
  const auto top_vertices = static_cast<int>(surface.vertex_count());
  const int centre = top_vertices + around;
  SurfaceMesh solid;
  solid.vertices.resize(3, Eigen::Index{centre} + 1);
  solid.vertices.leftCols(top_vertices) = surface.vertices;
  solid.triangles.resize(3, surface.triangle_count() + Eigen::Index{3} * around);
  solid.triangles.leftCols(surface.triangle_count()) = surface.triangles;
  Eigen::Index t = surface.triangle_count();
  for (int i = 0; i < around; ++i) {
    const int a = loop[static_cast<std::size_t>(i)];
    const int b = loop[static_cast<std::size_t>((i + 1) % around)];
    const int a_back = top_vertices + i;
    const int b_back = top_vertices + (i + 1) % around;
    solid.vertices.col(a_back) << flat(surface, a), 0.0;
    solid.triangles.col(t++) << b, a, a_back;
    solid.triangles.col(t++) << b, a_back, b_back;
    solid.triangles.col(t++) << b_back, a_back, centre;
  }
  solid.vertices.col(centre) << middle(surface), 0.0;
  return solid;
}

/// With a back that has the surface's triangles, mirrored.
SurfaceMesh solid_on(const FrontSurface& front, const SurfaceMesh& surface,
                     const std::vector<int>& loop, const std::string& name) {
  const auto count = static_cast<int>(surface.vertex_count());
  const Eigen::Index faces = surface.triangle_count();
  SurfaceMesh solid;
  solid.vertices.resize(3, 2 * Eigen::Index{count});
  solid.vertices.leftCols(count) = surface.vertices;
  for (int v = 0; v < count; ++v) {
    const Eigen::Vector2d place = flat(surface, v);
    if (!front.covers(place) || !(surface.vertices(2, v) > front.height(place))) {
      refuse(name, "reaches down to its front at vertex " + std::to_string(v));
    }
    solid.vertices.col(count + v) << place, front.height(place);
  }
  solid.triangles.resize(3, 2 * faces + 2 * static_cast<Eigen::Index>(loop.size()));
  solid.triangles.leftCols(faces) = surface.triangles;
  Eigen::Index t = faces;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int a = loop[i];
    const int b = loop[(i + 1) % loop.size()];
    solid.triangles.col(t++) << b, a, count + a;
    solid.triangles.col(t++) << b, count + a, count + b;
  }
  solid.triangles.rightCols(faces) = surface.triangles.colwise().reverse().array() + count;
  return solid;
}

}  // namespace

std::vector<int> height_field_outline(const SurfaceMesh& surface, const std::string& name) {
  require_above_back(surface, name);
  require_faces_up(surface, name);
  std::vector<int> loop = walk(successors(surface, name), name);
  require_simple(surface, loop, name);
  return loop;
}

void require_rectangle(const SurfaceMesh& surface, const std::vector<int>& outline,
                       const std::string& name) {
  constexpr double kOnBorder = 1e-9;  // mm
  const auto xy = surface.vertices.topRows<2>();
  const Eigen::Array2d low = xy.rowwise().minCoeff();
  const Eigen::Array2d high = xy.rowwise().maxCoeff();
  for (const int v : outline) {
    const Eigen::Array2d p = flat(surface, v);
    if ((p - low).min(high - p).minCoeff() <= kOnBorder) continue;
    refuse(name, "has an outline that is no rectangle: vertex " + std::to_string(v) +
                     " of its border lies inside the rectangle around it");
  }
}

SurfaceMesh closed_solid(const SurfaceMesh& surface, const std::string& name,
                         const std::optional<Front>& front) {
  const std::vector<int> loop = height_field_outline(surface, name);
  if (front) return solid_on(FrontSurface(*front), surface, loop, name);
  if (is_seen_from_middle(surface, loop)) return solid_around_middle(surface, loop);
  return solid_on(FrontSurface(), surface, loop, name);
}

double enclosed_volume(const SurfaceMesh& solid) {
  double volume = 0.0;
  for (Eigen::Index t = 0; t < solid.triangles.cols(); ++t) {
    volume += solid.corner(t, 0).dot(solid.corner(t, 1).cross(solid.corner(t, 2)));
  }
  return volume / 6.0;
}

}  // namespace lensforge
