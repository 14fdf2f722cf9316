// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/flat_faces.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "design/reflect/mesh/edges.h"

namespace lensforge::reflect {
namespace {

/// A face is without area below this share of the square of its longest side: 1e-9 is a needle a
/// thousand million times as long as it is wide, which single precision cannot tell from a line.
constexpr double kLeastFlatness = 1e-9;

/// Faces in one line may have to wait for each other; those that are left then are dropped.
constexpr int kPasses = 16;

Eigen::Vector3d squared_sides(const Corners& c) {
  return {(c.v1 - c.v0).squaredNorm(), (c.v2 - c.v1).squaredNorm(), (c.v0 - c.v2).squaredNorm()};
}

bool is_flat(const SurfaceMesh& mesh, Eigen::Index face) {
  const Corners c = mesh.corners(face);
  return !(area_normal(c).norm() > kLeastFlatness * squared_sides(c).maxCoeff());
}

bool has_corner_twice(const SurfaceMesh& mesh, Eigen::Index face) {
  const Eigen::Vector3i t = mesh.triangles.col(face);
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

void drop(FullFaces& full, const std::function<bool(Eigen::Index)>& unwanted) {
  Eigen::Index kept = 0;
  for (Eigen::Index face = 0; face < full.mesh.triangle_count(); ++face) {
    if (unwanted(face)) continue;
    full.mesh.triangles.col(kept) = full.mesh.triangles.col(face).eval();
    full.origin[static_cast<std::size_t>(kept)] = full.origin[static_cast<std::size_t>(face)];
    ++kept;
  }
  full.mesh.triangles.conservativeResize(3, kept);
  full.origin.resize(static_cast<std::size_t>(kept));
}

/// The side of a face that joins two of its corners.
int side_between(const Eigen::Vector3i& face, int a, int b) {
  int k = 0;
  while (k < 2 && (face[(k + 2) % 3] == a || face[(k + 2) % 3] == b)) ++k;
  return k;
}

/// Divides `neighbour` at the corner of a flat face that is opposite to side k, which they share.
/// Two faces with the same corners have nothing between them: both get a corner twice.
void divide(FullFaces& full, Eigen::Index flat, int k, Eigen::Index neighbour) {
  Eigen::Matrix3Xi& triangles = full.mesh.triangles;
  const int middle = triangles((k + 2) % 3, flat);
  const int side =
      side_between(triangles.col(neighbour), triangles(k, flat), triangles((k + 1) % 3, flat));
  const int from = triangles(side, neighbour);
  const int to = triangles((side + 1) % 3, neighbour);
  const int apex = triangles((side + 2) % 3, neighbour);
  triangles.col(flat) << from, middle, apex;
  triangles.col(neighbour) << middle, to, apex;
  full.origin[static_cast<std::size_t>(flat)] = full.origin[static_cast<std::size_t>(neighbour)];
}

/// @return whether any face was divided.
bool divide_neighbours(FullFaces& full) {
  const EdgeTable table = make_edges(full.mesh);
  std::vector<bool> changed(full.origin.size());
  bool any = false;
  for (Eigen::Index face = 0; face < full.mesh.triangle_count(); ++face) {
    if (changed[static_cast<std::size_t>(face)] || !is_flat(full.mesh, face)) continue;
    int longest = 0;
    squared_sides(full.mesh.corners(face)).maxCoeff(&longest);
    const int neighbour = table.across(face, longest);
    if (neighbour < 0 || changed[static_cast<std::size_t>(neighbour)]) continue;
    divide(full, face, longest, neighbour);
    changed[static_cast<std::size_t>(face)] = changed[static_cast<std::size_t>(neighbour)] = true;
    any = true;
  }
  return any;
}

}  // namespace

FullFaces without_flat_faces(const SurfaceMesh& mesh) {
  FullFaces full{mesh, std::vector<int>(static_cast<std::size_t>(mesh.triangle_count())), 0};
  std::iota(full.origin.begin(), full.origin.end(), 0);
  const auto flat = [&](Eigen::Index face) { return is_flat(full.mesh, face); };
  for (Eigen::Index face = 0; face < mesh.triangle_count(); ++face) full.removed += flat(face);
  if (full.removed == 0) return full;
  const auto doubled = [&](Eigen::Index face) { return has_corner_twice(full.mesh, face); };
  drop(full, doubled);
  for (int pass = 0; pass < kPasses && divide_neighbours(full); ++pass) drop(full, doubled);
  drop(full, flat);
  return full;
}

}  // namespace lensforge::reflect
