// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/boundary_term.h"
#include "design/energy/correspondence_term.h"
#include "design/energy/objective_sums.h"
#include "design/energy/objective_view.h"
#include "design/energy/smoothness_term.h"
#include "design/energy/unlit_pixels.h"
#include "design/energy/unlit_term.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"

/// What the objective does for one face or vertex on the way from the picture's cotangent back to
/// the vertices; the way there is in objective_kernels.h, Rays too.
namespace lensforge {

/// Derivatives by what a face is made of; summed up and carried to its corners at the end.
struct FaceBar {
  Corners corners;
  Eigen::Vector3d n{0.0, 0.0, 0.0};  ///< Its unit normal.
  Eigen::Vector3d area_normal{0.0, 0.0, 0.0};
};

/// Weighted derivatives of what a picture says of an image triangle, and the values.
LF_HD inline GoalSums picture_adjoint(const ObjectiveView& o, const ImageTriangle& image,
                                      ImageTriangle& bar) {
  const GoalView& goal = o.goal;
  GoalSums values;
  bar = deposit_adjoint(magnified(image, goal.parts), goal.cotangent);
  bar = magnified(bar, goal.parts);
  values.boundary = boundary_term(image, goal.columns, goal.rows, o.weights.boundary, bar);
  return values;
}

/// The same of the parts of a face that lie inside of the outline.
LF_HD inline GoalSums rim_adjoint(const ObjectiveView& o, std::int64_t face,
                                  const ImageTriangle& image, ImageTriangle& bar) {
  GoalSums values;
  for (std::int64_t k = o.aperture.first[face]; o.aperture.pieces[k].face == face; ++k) {
    const TrianglePiece& piece = o.aperture.pieces[k].piece;
    ImageTriangle piece_bar;
    values += picture_adjoint(o, image_of(image, piece), piece_bar);
    image_of_adjoint(piece, piece_bar, bar);
  }
  return values;
}

/// Weighted derivatives of what the goal says of one face's image triangle, and the values.
LF_HD inline GoalSums goal_adjoint(const ObjectiveView& o, std::int64_t face,
                                   const ImageTriangle& image, ImageTriangle& bar) {
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
  values = picture_adjoint(o, image, bar);
  if (goal.led != nullptr && goal.led[face] != kNoPixel) {
    const std::int32_t pixel = goal.led[face];
    values.unlit = unlit_term(image, pixel, goal.columns, goal.target[pixel], w.image, bar);
  }
  return values;
}

/// Weighted derivatives of a face's barriers; returns its E_barr.
LF_HD inline double barrier_adjoint(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                    FaceBar& bar) {
  const double weight = o.weights.barrier;
  const ValueSlope area = area_barrier(plan_area(t), o.area);
  bar.area_normal.z() += 0.5 * weight * area.slope;
  return area.value + o.light.barrier_adjoint(t, o.scratch.frames[face].n, weight, bar.corners,
                                              bar.n, o.incident_at(face));
}

/// Derivatives of everything by one face's corners.
template <class Rays>
struct PullBackFace {
  ObjectiveView o;
  Rays rays;

  LF_HD FaceSums::Packed operator()(std::int64_t i) const {
    const Corners t = o.corners(i);
    const FaceFrame& frame = o.scratch.frames[i];
    const double doubled_area = frame.n.dot(area_normal(t));  // |N|, without its root
    FaceBar bar;
    FaceSums sums;
    sums.goal = rays.pull_back(o, i, t, bar);
    sums.barrier = barrier_adjoint(o, i, t, bar);
    if (o.weights.smooth > 0.0) {
      double area_bar = 0.0;
      const FaceFrame bend = bend_adjoint(o, i, area_bar);
      bar.n += bend.n;
      bar.area_normal += 0.5 * area_bar * frame.n;
      const Eigen::Vector3d third = (1.0 / 3.0) * bend.c;
      bar.corners.v0 += third;
      bar.corners.v1 += third;
      bar.corners.v2 += third;
    }
    bar.area_normal += normalize_adjoint(frame.n, doubled_area, bar.n);
    area_normal_adjoint(t, bar.area_normal, bar.corners);
    o.scratch.corner_bar[i] = bar.corners;
    return sums.packed();
  }
};

/// Gradient by a vertex: the sum over its corners.
template <class Rays>
struct GatherVertex {
  ObjectiveView o;
  Rays rays;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const {
    Eigen::Vector3d sum = rays.vertex_bar(v);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const Corners& bar = o.scratch.corner_bar[corner / 3];
      sum += corner % 3 == 0 ? bar.v0 : (corner % 3 == 1 ? bar.v1 : bar.v2);
    }
    column3(gradient, v) = sum;
  }
};

/// Clears what a held coordinate's derivative is.
struct HoldCoordinate {
  const double* movable;
  double* gradient;
  LF_HD void operator()(std::int64_t i) const { gradient[i] *= movable[i]; }
};

}  // namespace lensforge
