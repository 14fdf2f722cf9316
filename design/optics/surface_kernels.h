// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/optics/light_path.h"
#include "design/optics/columns.h"
#include "design/optics/facet.h"
#include "design/optics/smooth.h"

/// What rendering a surface does for one triangle or vertex.
namespace lensforge {

/// A mesh's arrays in the memory of an executor, and the light that falls on it.
struct SurfaceView {
  const int* triangles;    ///< 3 × T
  const double* vertices;  ///< 3 × V, mm
  LightPath light;
  VertexRays incident;       ///< As find_rays() gives them.
  std::int64_t nothing = 0;  ///< Without it bytes of a kernel's argument would be left unset.

  [[nodiscard]] LF_HD Corners corners(std::int64_t i) const {
    return corners_at(triangles + 3 * i, vertices);
  }
};

/// The same light for an executor's kernels: what it refers to is copied into `front`, a buffer of
/// that executor, which must outlive it.
template <class Exec>
LightPath light_for(const Exec& executor, const LightPath& light,
                    typename Exec::template Buffer<double>& front) {
  const std::span<const double> coefficients = light.front_coefficients();
  if (coefficients.empty()) return light;
  if (front.size() == 0) front = buffer_of(executor, coefficients);
  return light.reading(front.data());
}

/// The ray that comes to a vertex.
struct FindRay {
  LightPath light;
  const double* vertices;
  IncidentRay* rays;

  LF_HD void operator()(std::int64_t v) const { rays[v] = light.ray_to(column3(vertices, v)); }
};

/// Fills `rays` with those that come to all vertices, and lets it be empty in light of one
/// direction: each is solved for once, not for every corner that asks.
template <class Exec>
VertexRays find_rays(const Exec& executor, const LightPath& light, const double* vertices,
                     std::int64_t count, typename Exec::template Buffer<IncidentRay>& rays) {
  if (!light.varies()) return {};
  if (rays.size() == 0)
    rays = typename Exec::template Buffer<IncidentRay>(static_cast<std::size_t>(count));
  parallel_for(executor, "incident rays", count, FindRay{light, vertices, rays.data()});
  return {rays.data()};
}

/// Facet model: the image triangle of a triangle; without flux where it does not transmit.
struct ProjectFacet {
  SurfaceView surface;

  LF_HD ImageTriangle operator()(std::int64_t i) const {
    const Corners t = surface.corners(i);
    const Eigen::Vector3d n = area_normal(t).normalized();
    const CornerRays known = surface.incident.at(surface.triangles + 3 * i);
    if (!surface.light.transmits(t, n, known)) return {};
    return project_facet(t, surface.light.facet_beam(t, n, known), surface.light);
  }
};

/// Smooth model: where a vertex's ray lands; NaN where it does not transmit.
struct LandRay {
  SurfaceView surface;
  const double* normals;  ///< 3 × V, vertex_area_normals().
  double* landing;        ///< 2 × V

  LF_HD void operator()(std::int64_t v) const {
    const Eigen::Vector3d n = VertexNormal(column3(normals, v)).n;
    const Eigen::Vector3d p = column3(surface.vertices, v);
    const IncidentRay* const known = surface.incident.at(v);
    if (surface.light.transmits(p, n, known)) {
      column2(landing, v) = project_vertex(p, n, surface.light, known);
    } else {
      column2(landing, v).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
};

/// Smooth model: the image triangle of a triangle; without flux where it is not lit from below.
struct ProjectSmooth {
  SurfaceView surface;
  const double* landing;  ///< 2 × V

  LF_HD static bool is_finite(const Eigen::Vector2d& p) {
    return std::fabs(p.x()) < std::numeric_limits<double>::infinity() &&
           std::fabs(p.y()) < std::numeric_limits<double>::infinity();
  }
  LF_HD ImageTriangle operator()(std::int64_t i) const {
    const int* v = surface.triangles + 3 * i;
    const ImageTriangle image{column2(landing, v[0]), column2(landing, v[1]),
                              column2(landing, v[2]),
                              surface.light.flux(surface.corners(i), surface.incident.at(v))};
    const bool lit = is_finite(image.p0) && is_finite(image.p1) && is_finite(image.p2);
    return lit && !(image.flux < 0.0) ? image : ImageTriangle{};
  }
};

}  // namespace lensforge
