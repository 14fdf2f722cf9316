// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/compute/host_device.h"
#include "core/compute/scalar.h"
#include "core/image/color.h"
#include "design/energy/objective_view.h"
#include "design/energy/picture_terms.h"
#include "design/energy/smoothness.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// f_area(a) = ((ε2 − ε1)/(a − ε1) − 1)² for ε1 < a < ε2, 0 above, ∞ below (Sun et al., Eq. 8).
template <class T>
LF_HD LF_INLINE ValueSlopeOf<T> area_barrier(const T& area, const AreaBarrier& barrier) {
  const T none{};
  const T above = area - barrier.lower;
  const T ratio = (barrier.upper - barrier.lower) / above;
  const T value = above > none ? (ratio - 1.0) * (ratio - 1.0) : none + kInfinity;
  const T slope = above > none ? -2.0 * (ratio - 1.0) * ratio / above : none;
  const MaskOf<T> large = area >= barrier.upper;
  return {large ? none : value, large ? none : slope};
}

// Forward: surface → frames, Weingarten maps, image triangles, picture error, for one face, vertex
// or pixel. Rays says how a face sends its light: FacetRays, SmoothRays or SplineRays.

/// Stores the frame and area of a face for the smoothness terms, and its flux where that is costly
/// to compute. Returns its share of E_barr, which is infinite where the surface is not allowed.
struct MeasureFace {
  ObjectiveView o;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const Corners t = o.corners(i);
    const FaceNormal normal(t);
    if (o.scratch.frames != nullptr) {
      o.scratch.frames[i] = {normal.n, centroid(t)};
      o.scratch.doubled_areas[i] = normal.doubled_area;
    }
    const CornerRays rays = o.incident_at(i);
    if (o.scratch.flux != nullptr) o.scratch.flux[i] = o.light.flux(t, rays);
    return {barrier(t, normal.n, rays)};
  }
  /// A face's share of E_barr.
  template <class T>
  [[nodiscard]] LF_HD LF_INLINE T barrier(const CornersOf<T>& t, const SpaceVector<T>& n,
                                          const CornerRays& rays = {}) const {
    return area_barrier(plan_area(t), o.area).value + o.light.barrier(t, n, rays);
  }
};

/// Image triangles of the faces, as a source of FluxImageOn::render(): first one for every face,
/// empty unless the whole face is inside the outline, then those of the parts inside.
/// @pre the rays' arrays are up to date.
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

/// Centroid of a face's image; NaN if the outline cuts the face. @pre as for FaceLightSource.
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

  LF_HD void operator()(std::int64_t i) const {
    o.scratch.maps[i] = FittedFaceOf<double>(face_ring(o, i), o.weights.edge).map;
  }
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

/// Stores the Welsch weights of a face's edges from its map and its neighbours'; returns its half
/// of Σ Ψ(h⁰) − w h⁰.
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

/// Stores a pixel's error and clears its cotangent; returns |g − g̃|.
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

/// Turns a pixel's cotangent by its display-encoded value into that by its flux.
struct EncodeAdjoint {
  const double* flux;
  double target_total;
  double* bar;

  LF_HD void operator()(std::int64_t i) const {
    bar[i] *= encode_slope(target_total * flux[i]) * target_total;
  }
};

// Adjoint: from the picture's cotangent back to the vertices, for one face or vertex.

/// Derivatives by a face's corners, unit normal and area normal; at the end all are carried to the
/// corners.
template <class T>
struct FaceBarOf {
  CornersOf<T> corners;
  SpaceVector<T> n{T{}, T{}, T{}};  ///< Its unit normal.
  SpaceVector<T> area_normal{T{}, T{}, T{}};

  LF_HD LF_INLINE void carry_to_corners(const CornersOf<T>& t, const FaceNormalOf<T>& normal) {
    area_normal += normalize_adjoint<T>(normal.n, normal.doubled_area, n);
    area_normal_adjoint<T>(t, area_normal, corners);
  }
};
using FaceBar = FaceBarOf<double>;

/// Weighted derivatives of the picture terms by one image triangle, and their values.
/// @param deposited  deposit_adjoint() of the image in parts of pixels; null if not known.
LF_HD inline GoalSums picture_adjoint(const ObjectiveView& o, const ImageTriangle& image,
                                      const ImageTriangle* deposited, ImageTriangle& bar) {
  const GoalView& goal = o.goal;
  GoalSums values;
  bar = deposited != nullptr ? *deposited
                             : deposit_adjoint(magnified(image, goal.parts), goal.cotangent);
  bar = magnified(bar, goal.parts);
  values.boundary = boundary_term(image, goal.columns, goal.rows, o.weights.boundary, bar);
  return values;
}

/// The same, summed over the parts of a face inside the outline.
LF_HD inline GoalSums rim_adjoint(const ObjectiveView& o, std::int64_t face,
                                  const ImageTriangle& image, ImageTriangle& bar) {
  GoalSums values;
  for (std::int64_t k = o.aperture.first[face]; o.aperture.pieces[k].face == face; ++k) {
    const TrianglePiece& piece = o.aperture.pieces[k].piece;
    ImageTriangle piece_bar;
    values += picture_adjoint(o, image_of(image, piece), nullptr, piece_bar);
    image_of_adjoint(piece, piece_bar, bar);
  }
  return values;
}

/// Weighted derivatives of the goal's terms by one face's image triangle, and their values.
/// @param deposited  as for picture_adjoint().
LF_HD inline GoalSums goal_adjoint(const ObjectiveView& o, std::int64_t face,
                                   const ImageTriangle& image, const ImageTriangle* deposited,
                                   ImageTriangle& bar) {
  const ObjectiveWeights& w = o.weights;
  const GoalView& goal = o.goal;
  GoalSums values;
  if (!goal.is_picture()) {
    const double share = o.aperture.share(face);
    const CorrespondenceValues v = correspondence_term(
        {image.p0, image.p1, image.p2, share * image.flux}, column2(goal.wanted_centroids, face),
        goal.wanted_flux[face], goal.pixels(), w, bar);
    bar.flux *= share;
    values.align = v.align;
    values.flux = v.flux;
    return values;
  }
  if (!o.aperture.is_whole(face)) return rim_adjoint(o, face, image, bar);
  values = picture_adjoint(o, image, deposited, bar);
  if (goal.led != nullptr && goal.led[face] != kNoPixel) {
    const std::int32_t pixel = goal.led[face];
    values.unlit = unlit_term(image, pixel, goal.columns, goal.target[pixel], w.image, bar);
  }
  return values;
}

/// Adds the weighted derivatives of a face's barriers; returns its E_barr.
template <class T>
LF_HD LF_INLINE T barrier_adjoint(const ObjectiveView& o, const CornersOf<T>& t,
                                  const SpaceVector<T>& n, FaceBarOf<T>& bar,
                                  const CornerRays& rays = {}) {
  const double weight = o.weights.barrier;
  const ValueSlopeOf<T> area = area_barrier(plan_area(t), o.area);
  bar.area_normal.z() += 0.5 * weight * area.slope;
  return area.value + o.light.barrier_adjoint(t, n, weight, bar.corners, bar.n, rays);
}

/// Adds the derivatives of the smoothness terms of a face and its neighbours. @param n  of the
/// face.
template <class T>
LF_HD LF_INLINE void add_bends(const BendRing<T>& ring, const SpaceVector<T>& n,
                               FaceBarOf<T>& bar) {
  const FaceFrameOf<T> bend = bend_adjoint(ring);
  bar.n += bend.n;
  const T by_normal = 0.5 * ring.by_area;
  bar.area_normal += by_normal * n;
  const SpaceVector<T> third = (1.0 / 3.0) * bend.c;
  bar.corners.v0 += third;
  bar.corners.v1 += third;
  bar.corners.v2 += third;
}

/// Derivatives of all terms by one face's corners.
template <class Rays>
struct PullBackFace {
  ObjectiveView o;
  Rays rays;

  using Ray = typename Rays::Ray;
  [[nodiscard]] LF_HD Ray trace(std::int64_t i) const { return rays.trace(o, i); }

  LF_HD FaceSums::Packed operator()(std::int64_t i) const { return (*this)(i, trace(i), nullptr); }
  /// @param ray        Rays::trace().
  /// @param deposited  as for picture_adjoint().
  LF_HD LF_INLINE FaceSums::Packed operator()(std::int64_t i, const Ray& ray,
                                              const ImageTriangle* deposited) const {
    const Corners t = o.corners(i);
    const FaceNormal normal(t);
    FaceBar bar;
    FaceSums sums;
    sums.goal = rays.pull_back(o, i, t, ray, deposited, bar);
    sums.barrier = barrier_adjoint(o, t, normal.n, bar, o.incident_at(i));
    if (o.weights.smooth > 0.0) add_bends(bend_ring(o, i), normal.n, bar);
    bar.carry_to_corners(t, normal);
    o.scratch.corner_bar[i] = bar.corners;
    return sums.packed();
  }
};

/// Gradient by a vertex: what its ray adds, and the sum over its corners.
template <class Rays>
struct GatherVertex {
  ObjectiveView o;
  Rays rays;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const { add_corners(v, rays.vertex_bar(o, v)); }
  LF_HD void add_corners(std::int64_t v, Eigen::Vector3d sum) const {
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const Corners& bar = o.scratch.corner_bar[corner / 3];
      sum += corner % 3 == 0 ? bar.v0 : (corner % 3 == 1 ? bar.v1 : bar.v2);
    }
    column3(gradient, v) = sum;
  }
};

/// Clears the derivatives by held coordinates.
struct HoldCoordinate {
  const double* movable;
  double* gradient;
  LF_HD void operator()(std::int64_t i) const { gradient[i] *= movable[i]; }
};

}  // namespace lensforge
