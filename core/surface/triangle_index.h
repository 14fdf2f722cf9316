// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Position of a point seen from above: its triangle (−1 if none) and weights there.
struct PlaceOnMesh {
  std::int64_t triangle = -1;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< Barycentric.
};

/// Finds the triangle of a height field above or below a point.
class TriangleIndex {
 public:
  /// Stores triangle numbers, not the mesh.
  explicit TriangleIndex(const SurfaceMesh& mesh);

  /// @param mesh  the mesh that the index was built for; heights may differ.
  [[nodiscard]] PlaceOnMesh locate(const SurfaceMesh& mesh, const Eigen::Vector2d& xy) const;

  /// Bounding box of the mesh.
  [[nodiscard]] const Eigen::AlignedBox2d& box() const { return box_; }

 private:
  [[nodiscard]] std::int64_t bin_of(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Eigen::Vector2i bin_cell(const Eigen::Vector2d& xy) const;

  Eigen::AlignedBox2d box_;
  Eigen::Vector2i bins_{1, 1};
  /// Triangles that may cover bin b are bin_triangles_[bin_begin_[b] … bin_begin_[b+1]).
  std::vector<std::int64_t> bin_begin_;
  std::vector<std::int32_t> bin_triangles_;
};

}  // namespace lensforge
