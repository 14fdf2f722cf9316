// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Map from points of the flat grid to the moved grid, seen from above. Design concentrates
/// vertices where the picture needs them, down to a thirtieth of the mean cell. The identity for a
/// mesh that is no grid, or whose border vertices have left the border.
class GridWarp {
 public:
  /// @param box  the mesh's rectangle, mm. Keeps a reference to the mesh.
  GridWarp(const SurfaceMesh& mesh, const Eigen::AlignedBox2d& box);

  /// @pre uv lies in the box.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& uv) const;
  /// Approximate inverse of at() at the vertex.
  [[nodiscard]] Eigen::Vector2d before(Eigen::Index vertex) const;

  /// x and y of the control points of a spline with these knot cells: `share` of the way from the
  /// even grid to the moved vertices, sampled at the Greville points (Schoenberg's operator, which
  /// folds nothing that is monotonic along its lines).
  [[nodiscard]] std::array<Eigen::MatrixXd, 2> control_points(int cells_u, int cells_v,
                                                              double share) const;

 private:
  [[nodiscard]] bool borders_hold() const;
  [[nodiscard]] Eigen::Vector2d displacement(double column, int row) const;
  [[nodiscard]] Eigen::Vector2d rest(Eigen::Index vertex) const;

  const SurfaceMesh& mesh_;
  Eigen::AlignedBox2d box_;
  bool moves_ = false;
};

}  // namespace lensforge
