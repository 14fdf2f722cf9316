// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/random_input.h"
#include "design/snell.h"

namespace lensforge::testing {

/// A forward Monte-Carlo tracer that shares no code with the renderer: rays of random x and y go up
/// +z, meet the triangle above them, are bent by Snell's law in angles and counted in pixels.
class RayTracer {
 public:
  RayTracer(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model)
      : mesh_(mesh), setup_(setup), buckets_(kBuckets * kBuckets) {
    const Eigen::Matrix3Xd normals = face_normals();
    for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) enter(t);
    landings_.resize(static_cast<std::size_t>(mesh.triangle_count()));
    const Eigen::Matrix3Xd around = sums_around_vertices(normals);
    for (int t = 0; t < static_cast<int>(mesh.triangle_count()); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int v = mesh.triangles(k, t);
        const Eigen::Vector3d n =
            model == SurfaceModel::kFacet ? normals.col(t) : Eigen::Vector3d(around.col(v));
        landings_[static_cast<std::size_t>(t)][static_cast<std::size_t>(k)] =
            landing(mesh.vertices.col(v), n.normalized());
      }
    }
  }

  /// Hits of every pixel, row by row from the top, for so many rays over the lens's rectangle, of
  /// which those go on that `passes` lets through.
  [[nodiscard]] std::vector<std::int64_t> trace(
      std::int64_t rays, std::uint64_t seed,
      const std::function<bool(const Eigen::Vector2d&)>& passes = {}) const {
    Random random(seed);
    const int columns = setup_.pixels.x();
    const int rows = setup_.pixels.y();
    std::vector<std::int64_t> hits(index(0, rows, columns), 0);
    for (std::int64_t i = 0; i < rays; ++i) {
      const Eigen::Vector2d p(random.between(0.0, setup_.lens_size.x()),
                              random.between(0.0, setup_.lens_size.y()));
      if (passes && !passes(p)) continue;
      // Front view: the picture's right and lower sides are at small x and y.
      const Eigen::Vector2d from_far =
          (setup_.image_origin + setup_.image_size - send(p)).cwiseQuotient(setup_.image_size);
      const int column = static_cast<int>(std::floor(from_far.x() * columns));
      const int row = static_cast<int>(std::floor(from_far.y() * rows));
      if (column < 0 || column >= columns || row < 0 || row >= rows) continue;
      ++hits[index(column, row, columns)];
    }
    return hits;
  }

 private:
  static constexpr int kBuckets = 40;

  [[nodiscard]] Eigen::Matrix3Xd face_normals() const {
    Eigen::Matrix3Xd normals(3, mesh_.triangle_count());
    for (Eigen::Index t = 0; t < normals.cols(); ++t) {
      const Eigen::Vector3d a = mesh_.corner(t, 0);
      normals.col(t) = (mesh_.corner(t, 1) - a).cross(mesh_.corner(t, 2) - a);
    }
    return normals;
  }
  [[nodiscard]] Eigen::Matrix3Xd sums_around_vertices(const Eigen::Matrix3Xd& normals) const {
    Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, mesh_.vertex_count());
    for (Eigen::Index t = 0; t < normals.cols(); ++t) {
      for (int k = 0; k < 3; ++k) sums.col(mesh_.triangles(k, t)) += normals.col(t);
    }
    return sums;
  }
  /// Point at which a ray from p meets the receiving plane, mm.
  [[nodiscard]] Eigen::Vector2d landing(const Eigen::Vector3d& p, const Eigen::Vector3d& n) const {
    const Eigen::Vector3d b = refract_by_angles(Eigen::Vector3d::UnitZ(), n, setup_.ior);
    const Eigen::Vector3d hit = p + (setup_.focal_length - p.z()) / b.z() * b;
    return hit.head<2>();
  }

  static std::size_t index(int column, int row, int columns) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] int bucket(double position, double size) const {
    return std::clamp(static_cast<int>(position / size * kBuckets), 0, kBuckets - 1);
  }
  void enter(int t) {
    const Eigen::Vector2d a = mesh_.corner(t, 0).head<2>();
    const Eigen::Vector2d b = mesh_.corner(t, 1).head<2>();
    const Eigen::Vector2d c = mesh_.corner(t, 2).head<2>();
    const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c);
    const Eigen::Vector2d high = a.cwiseMax(b).cwiseMax(c);
    for (int v = bucket(low.y(), setup_.lens_size.y()); v <= bucket(high.y(), setup_.lens_size.y());
         ++v) {
      for (int u = bucket(low.x(), setup_.lens_size.x());
           u <= bucket(high.x(), setup_.lens_size.x()); ++u) {
        buckets_[index(u, v, kBuckets)].push_back(t);
      }
    }
  }

  /// Landing point of the ray at p: its place in the triangle above it, mapped to the landing
  /// points of the corners (for a facet they share one direction, so this is the ray's own path).
  [[nodiscard]] Eigen::Vector2d send(const Eigen::Vector2d& p) const {
    const int u = bucket(p.x(), setup_.lens_size.x());
    const int v = bucket(p.y(), setup_.lens_size.y());
    double best = -1e9;
    Eigen::Vector2d result(1e9, 1e9);
    for (const int t : buckets_[index(u, v, kBuckets)]) {
      const Eigen::Vector3d share = barycentric(t, p);
      if (share.minCoeff() <= best) continue;
      best = share.minCoeff();
      const auto& corners = landings_[static_cast<std::size_t>(t)];
      result = share[0] * corners[0] + share[1] * corners[1] + share[2] * corners[2];
      if (best >= 0.0) break;
    }
    return result;
  }
  [[nodiscard]] Eigen::Vector3d barycentric(int t, const Eigen::Vector2d& p) const {
    const Eigen::Vector2d a = mesh_.corner(t, 0).head<2>();
    Eigen::Matrix2d sides;
    sides << mesh_.corner(t, 1).head<2>() - a, mesh_.corner(t, 2).head<2>() - a;
    const Eigen::Vector2d s = sides.inverse() * (p - a);
    return {1.0 - s.sum(), s.x(), s.y()};
  }

  const SurfaceMesh& mesh_;
  const OpticalSetup& setup_;
  std::vector<std::vector<int>> buckets_;
  std::vector<std::array<Eigen::Vector2d, 3>> landings_;
};

}  // namespace lensforge::testing
