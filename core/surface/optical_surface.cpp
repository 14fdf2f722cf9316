// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/optical_surface.h"

#include <utility>

#include "core/error.h"
#include "core/surface/facet_surface.h"
#include "core/surface/smooth_surface.h"

namespace lensforge {

OpticalSurface::OpticalSurface(SurfaceMesh mesh) : mesh_(std::move(mesh)), index_(mesh_) {}

std::optional<SurfacePoint> OpticalSurface::at(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return std::nullopt;
  return in_triangle(place.triangle, place.weights);
}

std::optional<SmoothPatch> OpticalSurface::patch_at(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return std::nullopt;
  return patch_in(place.triangle, place.weights);
}

std::shared_ptr<const OpticalSurface> optical_surface(const SurfaceMesh& mesh, SurfaceModel model) {
  switch (model) {
    case SurfaceModel::kFacet:
      return std::make_shared<const FacetSurface>(mesh);
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      LF_CHECK(false, "a mesh is no spline");
  }
  return std::make_shared<const SmoothSurface>(mesh);
}

}  // namespace lensforge
