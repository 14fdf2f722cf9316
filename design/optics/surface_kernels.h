// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

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
  VertexEntries entries;  ///< As enter_vertices() gives them, or none.

  [[nodiscard]] LF_HD Corners corners(std::int64_t i) const {
    return corners_at(triangles + 3 * i, vertices);
  }
};

/// Where the ray to a vertex enters a curved front.
struct EnterVertex {
  LightPath light;
  const double* vertices;
  FrontEntry* entries;

  LF_HD void operator()(std::int64_t v) const { entries[v] = light.enter(column3(vertices, v)); }
};

/// Finds the rays to all vertices behind a curved front, once for all corners that ask; `entries`
/// stays empty behind a flat one.
template <class Exec>
VertexEntries enter_vertices(const Exec& executor, const LightPath& light, const double* vertices,
                             std::int64_t count,
                             typename Exec::template Buffer<FrontEntry>& entries) {
  if (!light.is_bent()) return {};
  using Entries = typename Exec::template Buffer<FrontEntry>;
  if (entries.size() == 0) entries = Entries(static_cast<std::size_t>(count));
  parallel_for(executor, "front entries", count, EnterVertex{light, vertices, entries.data()});
  return {entries.data(), count};
}

/// Facet model: the image triangle of a triangle; without flux where it does not transmit.
struct ProjectFacet {
  SurfaceView surface;

  LF_HD ImageTriangle operator()(std::int64_t i) const {
    const Corners t = surface.corners(i);
    const Eigen::Vector3d n = area_normal(t).normalized();
    const CornerEntries known = surface.entries.at(surface.triangles + 3 * i);
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
    const FrontEntry* const known = surface.entries.at(v);
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
                              surface.light.flux(surface.corners(i), surface.entries.at(v))};
    const bool lit = is_finite(image.p0) && is_finite(image.p1) && is_finite(image.p2);
    return lit && !(image.flux < 0.0) ? image : ImageTriangle{};
  }
};

}  // namespace lensforge
