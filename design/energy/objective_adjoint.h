// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/boundary_term.h"
#include "design/energy/correspondence_term.h"
#include "design/energy/mean_curvature.h"
#include "design/energy/objective_sums.h"
#include "design/energy/objective_view.h"
#include "design/energy/unlit_pixels.h"
#include "design/energy/unlit_term.h"
#include "design/optics/columns.h"
#include "design/optics/image_triangle.h"

/// What the objective does for one face or vertex on the way from the picture's cotangent back to
/// the vertices; the way there is in objective_kernels.h, Rays too.
namespace lensforge {

/// Derivatives by what a face is made of; summed up and carried to its corners at the end.
struct FaceBar {
  Corners corners;
  FaceFrame frame;
  Eigen::Vector3d area_normal{0.0, 0.0, 0.0};
};

struct SmoothnessValues {
  double face = 0.0;
  double edge = 0.0;
};

/// Weighted derivatives of what the goal says of one image triangle, and the values.
LF_HD inline GoalSums goal_adjoint(const ObjectiveView& o, std::int64_t face,
                                   const ImageTriangle& image, ImageTriangle& bar) {
  const ObjectiveWeights& w = o.weights;
  const GoalView& goal = o.goal;
  GoalSums values;
  if (!goal.is_picture()) {
    const CorrespondenceValues v =
        correspondence_term(image, column2(goal.wanted_centroids, face), goal.wanted_flux[face],
                            goal.columns * goal.rows, w, bar);
    values.align = v.align;
    values.flux = v.flux;
    return values;
  }
  bar = deposit_adjoint(magnified(image, goal.parts), goal.cotangent);
  bar = magnified(bar, goal.parts);
  values.boundary = boundary_term(image, goal.columns, goal.rows, w.boundary, bar);
  if (goal.led != nullptr && goal.led[face] != kNoPixel) {
    const std::int32_t pixel = goal.led[face];
    values.unlit = unlit_term(image, pixel, static_cast<std::int64_t>(goal.columns),
                              goal.target[pixel], w.image, bar);
  }
  return values;
}

/// Weighted derivatives of a face's barriers; returns its E_barr.
LF_HD inline double barrier_adjoint(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                    FaceBar& bar) {
  const double weight = o.weights.barrier;
  const ValueSlope area = area_barrier(plan_area(t), o.area);
  bar.area_normal.z() += 0.5 * weight * area.slope;
  return area.value +
         o.light.barrier_adjoint(t, o.scratch.frames[face].n, weight, bar.corners, bar.frame.n);
}

/// Weighted derivatives of E_face and of the linear part of E_edge by one face's frame and area
/// normal, and its own share of both values.
LF_HD inline SmoothnessValues smoothness_adjoint(const ObjectiveView& o, std::int64_t face,
                                                 double doubled_area, FaceBar& bar) {
  const double weight = o.weights.smooth;
  const CurvedFace here{o.scratch.frames[face], o.scratch.maps[face]};
  CurvedFace here_bar;   // Its map part vanishes in sum, since the map is the minimiser.
  CurvedFace there_bar;  // The neighbours gather their own part themselves.
  double area_bar = 0.0;
  SmoothnessValues values;
  values.face = mean_curvature_term(here.map, 0.5 * doubled_area, weight, here_bar.map, area_bar);
  bar.area_normal += 0.5 * area_bar * here.frame.n;
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(face, k);
    if (j < 0) continue;
    const CurvedFace there{o.scratch.frames[j], o.scratch.maps[j]};
    const double w = o.scratch.edge_weights[3 * face + k];
    const double scaled = weight * o.weights.edge * w;
    values.edge += w * mismatch_adjoint(here, there.frame, scaled, here_bar, there_bar.frame);
    mismatch_adjoint(there, here.frame, scaled, there_bar, here_bar.frame);
  }
  bar.frame.n += here_bar.frame.n;
  bar.frame.e1 += here_bar.frame.e1;
  bar.frame.c += here_bar.frame.c;
  return values;
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
      const SmoothnessValues smoothness = smoothness_adjoint(o, i, doubled_area, bar);
      sums.face = smoothness.face;
      sums.edge = smoothness.edge;
      tangent_adjoint(t, frame, bar.frame, bar.corners);
    }
    bar.area_normal += normalize_adjoint(frame.n, doubled_area, bar.frame.n);
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
