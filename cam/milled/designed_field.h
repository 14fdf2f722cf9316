// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/contact/cut_surface.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// The facets of a mesh, not smoothed; `cut` is the number of the facet, the lowest one on a seam.
/// Nodes beside the mesh, up to FacetGrid::kRim, lie on the plane of the nearest facet.
class FacetField final : public SurfaceField {
 public:
  /// @param mesh  must outlive the field. @pre every triangle faces +z, and there is one.
  explicit FacetField(const SurfaceMesh& mesh) : grid_(mesh) {}

  /// @throw InputError naming a node farther from the mesh than FacetGrid::kRim.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

  [[nodiscard]] const FacetGrid& grid() const { return grid_; }

 private:
  FacetGrid grid_;
};

/// A surface without creases; no pieces. Nodes beside the mesh, up to
/// FacetGrid::kRim, lie on the tangent plane of the rim.
class SmoothField final : public SurfaceField {
 public:
  /// @param surface  must outlive the field. @pre not surface.has_creases()
  explicit SmoothField(const OpticalSurface& surface) : surface_(surface), grid_(surface.mesh()) {}

  /// @throw InputError naming a node farther from the mesh than FacetGrid::kRim.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const OpticalSurface& surface_;
  FacetGrid grid_;
};

}  // namespace lensforge
