// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// The triangles of a height field by where they lie, seen from above.
class FacetGrid {
 public:
  /// Points up to this far outside of the mesh belong to its nearest triangle, mm: a rim may be
  /// that far off its rectangle (kRimDistance).
  static constexpr double kRim = 0.02;

  /// @param mesh  must outlive the grid. @pre every triangle faces +z, and there is one.
  explicit FacetGrid(const SurfaceMesh& mesh);

  /// Numbers of all triangles whose boxes, kRim wider, overlap `box`; ascending.
  [[nodiscard]] std::vector<std::int32_t> near(const Eigen::AlignedBox2d& box) const;

  [[nodiscard]] const SurfaceMesh& mesh() const { return mesh_; }

 private:
  [[nodiscard]] Eigen::Vector2i cell_at(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Eigen::AlignedBox2d box_of(std::int64_t triangle) const;

  const SurfaceMesh& mesh_;
  Eigen::AlignedBox2d box_;
  Eigen::Vector2i cells_{1, 1};
  /// Triangles that overlap cell c are triangles_[begin_[c] … begin_[c + 1]).
  std::vector<std::int64_t> begin_;
  std::vector<std::int32_t> triangles_;
};

}  // namespace lensforge
