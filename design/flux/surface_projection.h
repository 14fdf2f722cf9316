// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// Facet model: one normal for the whole triangle (Sun et al., section 3.2).
///
/// @param beam  light that leaves the facet, LightPath::facet_beam().
/// @param flux  share of the light that the facet takes in (Eq. 1), LightPath::flux().
template <class T>
LF_HD LF_INLINE ImageTriangleOf<T> land_facet(const CornersOf<T>& t, const FacetBeamOf<T>& beam,
                                              const LightPath& light, const T& flux) {
  return {light.land<T>(t.v0, beam.slope(0)), light.land<T>(t.v1, beam.slope(1)),
          light.land<T>(t.v2, beam.slope(2)), flux};
}
LF_HD inline ImageTriangle project_facet(const Corners& t, const FacetBeam& beam,
                                         const LightPath& light) {
  return land_facet(t, beam, light, light.flux(t, beam.known));
}

/// Adjoint of project_facet() without the flux: adds to the corners' derivatives and returns n_bar,
/// the derivative by the unit normal.
template <class T>
LF_HD LF_INLINE SpaceVector<T> project_facet_adjoint(const CornersOf<T>& t, const SpaceVector<T>& n,
                                                     const FacetBeamOf<T>& beam,
                                                     const LightPath& light,
                                                     const ImageTriangleOf<T>& bar,
                                                     CornersOf<T>& grad) {
  FacetSlopesOf<T> m_bar;
  light.land_adjoint<T>(t.v0, beam.slope(0), bar.p0, grad.v0, m_bar.m0);
  light.land_adjoint<T>(t.v1, beam.slope(1), bar.p1, grad.v1, m_bar.m1);
  light.land_adjoint<T>(t.v2, beam.slope(2), bar.p2, grad.v2, m_bar.m2);
  return light.facet_beam_adjoint<T>(t, n, beam, m_bar, grad);
}

// Smooth model: one ray per vertex, refracted at the vertex normal; image triangles share corners
// and stretch. A milled and polished part is like this.

/// Normal of a vertex: the sum of the area normals around it, normalised (area weighting).
template <class T>
struct VertexNormalOf {
  SpaceVector<T> n;
  T length;  ///< |sum of area normals|, mm²·2

  LF_HD LF_INLINE explicit VertexNormalOf(const SpaceVector<T>& area_normal_sum)
      : length(length_of<T>(area_normal_sum)) {
    const T inverse = 1.0 / length;
    n = inverse * area_normal_sum;
  }
};
using VertexNormal = VertexNormalOf<double>;

/// Landing point of a vertex's ray, in pixel coordinates. @pre n transmits.
template <class T = double>
LF_HD LF_INLINE PlaneVector<T> project_vertex(const SpaceVector<T>& p, const SpaceVector<T>& n,
                                              const LightPath& light,
                                              const IncidentRay* known = nullptr) {
  return light.land<T>(p, light.beam<T>(p, n, known).m);
}

/// Adjoint of project_vertex(): adds to p_bar, returns n_bar.
template <class T = double>
LF_HD LF_INLINE SpaceVector<T> project_vertex_adjoint(
    const SpaceVector<T>& p, const SpaceVector<T>& n, const LightPath& light,
    const PlaneVector<T>& u_bar, SpaceVector<T>& p_bar, const IncidentRay* known = nullptr) {
  const RefractedBeamOf<T> beam = light.beam<T>(p, n, known);
  PlaneVector<T> m_bar{T{}, T{}};
  light.land_adjoint<T>(p, beam.m, u_bar, p_bar, m_bar);
  return light.beam_adjoint<T>(p, n, beam, m_bar, p_bar, known);
}

// Faces that an outline cuts.

/// The image of a part of a face.
LF_HD inline ImageTriangle image_of(const ImageTriangle& face, const TrianglePiece& piece) {
  const auto corner = [&](int k) -> Eigen::Vector2d {
    return piece.weights(0, k) * face.p0 + piece.weights(1, k) * face.p1 +
           piece.weights(2, k) * face.p2;
  };
  return {corner(0), corner(1), corner(2), piece.share * face.flux};
}

/// Adjoint of image_of(): adds to the derivatives by the face's image.
LF_HD inline void image_of_adjoint(const TrianglePiece& piece, const ImageTriangle& bar,
                                   ImageTriangle& face_bar) {
  const auto corner = [&](int j) -> Eigen::Vector2d {
    return piece.weights(j, 0) * bar.p0 + piece.weights(j, 1) * bar.p1 +
           piece.weights(j, 2) * bar.p2;
  };
  face_bar.p0 += corner(0);
  face_bar.p1 += corner(1);
  face_bar.p2 += corner(2);
  face_bar.flux += piece.share * bar.flux;
}

// Kernels that project a surface, one triangle or vertex at a time.

/// A mesh's arrays in the memory of an executor, and the light that falls on it.
struct SurfaceView {
  const int* triangles;    ///< 3 × T
  const double* vertices;  ///< 3 × V, mm
  LightPath light;
  VertexRays incident;       ///< From find_rays().
  std::int64_t nothing = 0;  ///< Keeps all bytes of a kernel's argument set.

  [[nodiscard]] LF_HD Corners corners(std::int64_t i) const {
    return corners_at(triangles + 3 * i, vertices);
  }
};

/// The same light for an executor's kernels: the front's coefficients are copied into `front`, a
/// buffer of that executor, which must outlive the result.
template <class Exec>
LightPath light_for(const Exec& executor, const LightPath& light,
                    typename Exec::template Buffer<double>& front) {
  const std::span<const double> coefficients = light.front_coefficients();
  if (coefficients.empty()) return light;
  if (front.size() == 0) front = buffer_of(executor, coefficients);
  return light.reading(front.data());
}

/// Finds the ray to a vertex.
struct FindRay {
  LightPath light;
  const double* vertices;
  IncidentRay* rays;

  LF_HD void operator()(std::int64_t v) const { rays[v] = light.ray_to(column3(vertices, v)); }
};

/// Fills `rays` with the rays to all vertices, so each is solved for only once; leaves it empty in
/// light of one direction.
template <class Exec>
VertexRays find_rays(const Exec& executor, const LightPath& light, const double* vertices,
                     std::int64_t count, typename Exec::template Buffer<IncidentRay>& rays) {
  if (!light.varies()) return {};
  if (rays.size() == 0)
    rays = typename Exec::template Buffer<IncidentRay>(static_cast<std::size_t>(count));
  parallel_for(executor, "incident rays", count, FindRay{light, vertices, rays.data()});
  return {rays.data()};
}

/// Facet model: image triangle of a triangle; without flux if it does not transmit.
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

/// Smooth model: stores the landing point of a vertex's ray; NaN if it does not transmit.
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

/// Smooth model: image triangle of a triangle; without flux if a corner does not transmit, or its
/// flux is negative or no number.
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
    return lit && image.flux >= 0.0 ? image : ImageTriangle{};
  }
};

}  // namespace lensforge
