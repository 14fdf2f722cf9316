// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/facet_reach.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <limits>

#include "core/surface/mesh_normals.h"

namespace lensforge {
namespace {

std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

}  // namespace

FacetReach::FacetReach(const FacetGrid& grid, double radius, const Executor& executor)
    : radius_(radius) {
  const SurfaceMesh& mesh = grid.mesh();
  const std::int64_t count = mesh.triangle_count();
  planes_.resize(index_of(count));
  const auto make_plane = [&](std::int64_t t) {
    const Eigen::Vector3d normal = area_normal(mesh, t).normalized();
    planes_[index_of(t)] = {normal, normal.dot(mesh.corner(t, 0))};
  };
  parallel_for(executor, "facet planes", count, make_plane);
  std::vector<std::vector<std::int32_t>> found(index_of(count));
  const auto find = [&](std::int64_t t) {
    found[index_of(t)] = suspects_of(grid, static_cast<std::int32_t>(t));
  };
  parallel_for(executor, "facets in reach", count, find, 64);
  begin_.assign(1, 0);
  begin_.reserve(index_of(count) + 1);
  for (const auto& list : found) {
    begin_.push_back(begin_.back() + static_cast<std::int64_t>(list.size()));
  }
  suspects_.reserve(index_of(begin_.back()));
  for (const auto& list : found) suspects_.insert(suspects_.end(), list.begin(), list.end());
}

/// A ball that is tangent to facet f cuts no triangle that lies below the plane of f, and none from
/// whose plane its centre is at least R away; that distance is linear over the facet, so that its
/// corners tell.
std::vector<std::int32_t> FacetReach::suspects_of(const FacetGrid& grid, std::int32_t facet) const {
  const SurfaceMesh& mesh = grid.mesh();
  const Plane& plane = planes_[index_of(facet)];
  const double reach = radius_ * (1.0 + plane.normal.head<2>().norm());
  Eigen::AlignedBox2d box;
  for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(facet, k).head<2>()));
  const Eigen::Vector2d around(reach, reach);
  std::vector<std::int32_t> suspects;
  for (const std::int32_t t : grid.near({box.min() - around, box.max() + around})) {
    if (t == facet) continue;
    const Plane& other = planes_[index_of(t)];
    double highest = -std::numeric_limits<double>::infinity();
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      highest = std::max(highest, plane.normal.dot(mesh.corner(t, k)) - plane.level);
      const Eigen::Vector3d centre = mesh.corner(facet, k) + radius_ * plane.normal;
      nearest = std::min(nearest, other.normal.dot(centre) - other.level);
    }
    constexpr double kRounding = 1e-12;
    if (highest > kRounding && nearest < radius_ - kRounding) suspects.push_back(t);
  }
  return suspects;
}

bool FacetReach::surely_free(std::int32_t facet, const Eigen::Vector3d& centre) const {
  for (std::int64_t s = begin_[index_of(facet)]; s < begin_[index_of(facet) + 1]; ++s) {
    const Plane& other = planes_[index_of(suspects_[index_of(s)])];
    if (other.normal.dot(centre) - other.level < radius_) return false;
  }
  return true;
}

}  // namespace lensforge
