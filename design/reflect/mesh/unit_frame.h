// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/light_field.h"

namespace lensforge::reflect {

/// Diagonal of the bounding box that the paper's parameters are stated for (Tojo et al., 4.6).
inline constexpr double kUnitDiagonal = 3.0;

/// Takes a mesh to a bounding box about the origin with that diagonal, and back.
class UnitFrame {
 public:
  explicit UnitFrame(const SurfaceMesh& mesh);

  [[nodiscard]] double to_unit(double length) const { return length * scale_; }
  [[nodiscard]] Eigen::Vector3d to_unit(const Eigen::Vector3d& p) const {
    return scale_ * (p - centre_);
  }
  [[nodiscard]] SurfaceMesh to_unit(SurfaceMesh mesh) const;
  [[nodiscard]] LightField to_unit(LightField field) const;
  [[nodiscard]] SurfaceMesh from_unit(SurfaceMesh mesh) const;

 private:
  Eigen::Vector3d centre_;
  double scale_;
};

}  // namespace lensforge::reflect
