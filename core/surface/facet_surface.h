// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/surface/optical_surface.h"

namespace lensforge {

/// The facets of a mesh as they are (the paper's model): flat triangles between creases.
class FacetSurface final : public OpticalSurface {
 public:
  /// @pre every triangle faces +z (height_field_fault()).
  explicit FacetSurface(const SurfaceMesh& mesh) : OpticalSurface(mesh) {}

  [[nodiscard]] bool has_creases() const override { return true; }
  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override;
  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& weights) const override;
  /// Zero: the triangle is flat, and the creases around it do not count.
  [[nodiscard]] BendRange bend_range(std::int64_t /*triangle*/) const override { return {}; }
};

}  // namespace lensforge
