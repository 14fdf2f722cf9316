// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/compute/host_device.h"
#include "core/image/transfer.h"
#include "design/energy/objective_view.h"
#include "design/energy/smoothness_term.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"

/// What the objective does for one face, vertex or pixel on the way to its value: surface → frames,
/// Weingarten maps, image triangles, picture error. The way back is in objective_adjoint.h. How a
/// face sends its light is the surface model's: Rays is FacetRays or SmoothRays.
namespace lensforge {

/// Frame of a face, and its flux where that is costly; its share of E_barr, which is infinite where
/// the surface is not allowed.
struct MeasureFace {
  ObjectiveView o;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const Corners t = o.corners(i);
    const FaceFrame frame = face_frame(t);
    o.scratch.frames[i] = frame;
    const double area = plan_area(t);
    const CornerRays rays = o.incident_at(i);
    if (o.scratch.flux != nullptr) o.scratch.flux[i] = o.light.flux(t, rays);
    return {area_barrier(area, o.area).value + o.light.barrier(t, frame.n, rays)};
  }
};

/// What the faces project onto the screen, as a source of FluxImageOn::render(): the image of every
/// face that lies inside of the outline, nothing of the others, then those of their parts.
/// @pre frames, and what the rays keep of the surface, are up to date.
template <class Rays>
struct FaceLightSource {
  ObjectiveView o;
  Rays rays;
  [[nodiscard]] std::int64_t count() const { return o.mesh.faces + o.aperture.count; }
  LF_HD ImageTriangle operator()(std::int64_t i) const {
    if (i >= o.mesh.faces) {
      const MeshCut::Piece& part = o.aperture.pieces[i - o.mesh.faces];
      return magnified(image_of(rays.image(o, part.face), part.piece), o.goal.parts);
    }
    return o.aperture.is_whole(i) ? magnified(rays.image(o, i), o.goal.parts) : ImageTriangle{};
  }
};

/// Centroid of what a face projects onto the screen; no number where less than all of its light
/// does. @pre as of FaceLightSource.
template <class Rays>
struct FaceCentroid {
  ObjectiveView o;
  Rays rays;
  double* centroids;  ///< 2 × F, pixel coordinates.

  LF_HD static double nowhere() { return std::numeric_limits<double>::quiet_NaN(); }
  LF_HD void operator()(std::int64_t i) const {
    const ImageTriangle t = rays.image(o, i);
    column2(centroids, i) = (t.p0 + t.p1 + t.p2) / 3.0;
    if (!o.aperture.is_whole(i)) column2(centroids, i).setConstant(nowhere());
  }
};

/// The map of a face that minimises H²A + τ1 Σ w δ. @pre frames are up to date.
struct FitMap {
  ObjectiveView o;

  LF_HD void operator()(std::int64_t i) const { o.scratch.maps[i] = FittedFace(o, i).map; }
};

/// Equal weights for all of a face's edges, as on a flat surface.
struct ResetEdgeWeights {
  ObjectiveView o;

  LF_HD void operator()(std::int64_t i) const {
    const double flat = welsch(0.0, o.nu).slope;
    for (int k = 0; k < 3; ++k) {
      o.scratch.edge_weights[3 * i + k] = o.mesh.neighbour(i, k) < 0 ? 0.0 : flat;
    }
  }
};

/// Welsch weights of a face's edges from its map and its neighbours'; its half of Σ Ψ(h⁰) − w h⁰.
struct ReweightEdges {
  ObjectiveView o;

  /// h of edge k of a face, which is not on the boundary.
  [[nodiscard]] LF_HD double mismatch(std::int64_t face, int k) const {
    const int j = o.mesh.neighbour(face, k);
    const FaceFrame& frame_i = o.scratch.frames[face];
    const FaceFrame& frame_j = o.scratch.frames[j];
    return NeighbourOffset(frame_i, TangentBasis(frame_i.n), frame_j)
               .mismatch(o.scratch.maps[face]) +
           NeighbourOffset(frame_j, TangentBasis(frame_j.n), frame_i).mismatch(o.scratch.maps[j]);
  }
  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    double offset = 0.0;
    for (int k = 0; k < 3; ++k) {
      if (o.mesh.neighbour(i, k) < 0) continue;
      const double h = mismatch(i, k);
      const ValueSlope psi = welsch(h, o.nu);
      o.scratch.edge_weights[3 * i + k] = psi.slope;
      offset += 0.5 * (psi.value - psi.slope * h);
    }
    return {offset};
  }
};

struct AddEntry {
  const double* add;
  double* sum;

  LF_HD void operator()(std::int64_t i) const { sum[i] += add[i]; }
};

/// |g − g̃| of a pixel; sets its error and clears its cotangent.
struct ComparePixel {
  const double* flux;
  const double* target;
  double target_total;
  double* error;
  double* bar;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    error[i] = encode(target_total * flux[i]) - target[i];
    bar[i] = 0.0;
    return {std::fabs(error[i])};
  }
};

/// Cotangent of a pixel: by its display-encoded value → by its flux.
struct EncodeAdjoint {
  const double* flux;
  double target_total;
  double* bar;

  LF_HD void operator()(std::int64_t i) const {
    bar[i] *= encode_slope(target_total * flux[i]) * target_total;
  }
};

}  // namespace lensforge
