// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/boundary_term.h"
#include "design/energy/mean_curvature.h"
#include "design/energy/objective_view.h"
#include "design/energy/unlit_term.h"
#include "design/optics/smooth.h"

/// What the objective does for one face or vertex on the way from the picture's cotangent back to
/// the vertices; the way there is in objective_kernels.h.
namespace lensforge {

/// What the goal says of one face or of all.
struct GoalValues {
  double boundary = 0.0;
  double unlit = 0.0;
  CorrespondenceValues correspondence;
};

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

/// Weighted derivatives of what the goal says of one image triangle.
LF_HD inline GoalValues goal_adjoint(const ObjectiveView& o, std::int64_t face,
                                     const ImageTriangle& image, ImageTriangle& bar) {
  const ObjectiveWeights& w = o.options.weights;
  if (o.wanted_centroids != nullptr) {
    return {0.0, 0.0,
            correspondence_term(image, column2(o.wanted_centroids, face), o.wanted_flux[face],
                                o.columns * o.rows, w, bar)};
  }
  bar = deposit_adjoint(image, o.cotangent);
  GoalValues values;
  values.boundary = boundary_term(image, o.columns, o.rows, w.boundary, bar);
  if (o.led != nullptr && o.led[face] != kNoPixel) {
    const std::int32_t pixel = o.led[face];
    values.unlit = unlit_term(image, pixel, o.cotangent.columns, o.target[pixel], w.image, bar);
  }
  return values;
}

/// The goal's derivative by one face; returns its values (0 in the smooth model, where
/// PullBackImage has counted them).
LF_HD inline GoalValues image_adjoint(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                      FaceBar& bar) {
  if (o.facets()) {
    const Eigen::Vector3d& n = o.frames[face].n;
    const FacetBeam beam = o.light.facet_beam(t, n);
    const ImageTriangle image = project_facet(t, beam, o.light);
    ImageTriangle image_bar;
    const GoalValues values = goal_adjoint(o, face, image, image_bar);
    bar.frame.n += project_facet_adjoint(t, n, beam, o.light, image_bar, bar.corners);
    o.light.flux_adjoint(t, image_bar.flux, bar.corners, bar.area_normal);
    return values;
  }
  const int* v = o.mesh.triangle(face);
  for (int k = 0; k < 3; ++k) bar.area_normal += column3(o.vertex_normal_bar, v[k]);
  o.light.flux_adjoint(t, o.triangle_bar[face].flux, bar.corners, bar.area_normal);
  return {};
}

/// Weighted derivatives of a face's barriers; returns its E_barr.
LF_HD inline double barrier_adjoint(const ObjectiveView& o, std::int64_t face, const Corners& t,
                                    FaceBar& bar) {
  const double weight = o.options.weights.barrier;
  const ValueSlope area = area_barrier(0.5 * doubled_projected_area(t), o.options.area);
  bar.area_normal.z() += 0.5 * weight * area.slope;
  return area.value +
         o.light.barrier_adjoint(t, o.frames[face].n, weight, bar.corners, bar.frame.n);
}

/// Weighted derivatives of E_face and of the linear part of E_edge by one face's frame and area
/// normal, and its own share of both values.
LF_HD inline SmoothnessValues smoothness_adjoint(const ObjectiveView& o, std::int64_t face,
                                                 double doubled_area, FaceBar& bar) {
  const double weight = o.options.weights.smooth;
  const CurvedFace here{o.frames[face], o.maps[face]};
  CurvedFace here_bar;   // Its map part vanishes in sum, since the map is the minimiser.
  CurvedFace there_bar;  // The neighbours gather their own part themselves.
  double area_bar = 0.0;
  SmoothnessValues values;
  values.face = mean_curvature_term(here.map, 0.5 * doubled_area, weight, here_bar.map, area_bar);
  bar.area_normal += 0.5 * area_bar * here.frame.n;
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(face, k);
    if (j < 0) continue;
    const CurvedFace there{o.frames[j], o.maps[j]};
    const double w = o.edge_weights[3 * face + k];
    const double scaled = weight * o.options.weights.edge * w;
    values.edge += w * mismatch_adjoint(here, there.frame, scaled, here_bar, there_bar.frame);
    mismatch_adjoint(there, here.frame, scaled, there_bar, here_bar.frame);
  }
  bar.frame.n += here_bar.frame.n;
  bar.frame.e1 += here_bar.frame.e1;
  bar.frame.c += here_bar.frame.c;
  return values;
}

/// Values of a face that are summed over all: E_bdr, E_unlit, E_align, E_flux, E_barr, E_face,
/// E_edge.
using FaceSums = std::array<double, 7>;

/// Derivatives of everything by one face's corners.
struct PullBackFace {
  ObjectiveView o;

  LF_HD FaceSums operator()(std::int64_t i) const {
    const Corners t = o.corners(i);
    const FaceFrame& frame = o.frames[i];
    const double doubled_area = frame.n.dot(area_normal(t));  // |N|, without its root
    FaceBar bar;
    const GoalValues goal = image_adjoint(o, i, t, bar);
    const double barrier = barrier_adjoint(o, i, t, bar);
    SmoothnessValues smoothness;
    if (o.options.weights.smooth > 0.0) {
      smoothness = smoothness_adjoint(o, i, doubled_area, bar);
      tangent_adjoint(t, frame, bar.frame, bar.corners);
    }
    bar.area_normal += normalize_adjoint(frame.n, doubled_area, bar.frame.n);
    area_normal_adjoint(t, bar.area_normal, bar.corners);
    o.corner_bar[i] = bar.corners;
    return {goal.boundary,
            goal.unlit,
            goal.correspondence.align,
            goal.correspondence.flux,
            barrier,
            smoothness.face,
            smoothness.edge};
  }
};

/// Smooth model: derivatives of the goal by one image triangle; E_bdr, E_align, E_flux.
struct PullBackImage {
  ObjectiveView o;

  LF_HD std::array<double, 3> operator()(std::int64_t i) const {
    o.triangle_bar[i] = {};
    const GoalValues v = goal_adjoint(o, i, o.image_triangle(i), o.triangle_bar[i]);
    return {v.boundary, v.correspondence.align, v.correspondence.flux};
  }
};

/// Smooth model: derivatives by a landing point, carried to position and normal sum.
struct PullBackVertex {
  ObjectiveView o;

  LF_HD void operator()(std::int64_t v) const {
    Eigen::Vector2d u_bar(0.0, 0.0);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const ImageTriangle& bar = o.triangle_bar[corner / 3];
      u_bar += corner % 3 == 0 ? bar.p0 : (corner % 3 == 1 ? bar.p1 : bar.p2);
    }
    const VertexNormal normal(column3(o.vertex_normals, v));
    Eigen::Vector3d p_bar(0.0, 0.0, 0.0);
    const Eigen::Vector3d n_bar =
        project_vertex_adjoint(column3(o.vertices, v), normal.n, o.light, u_bar, p_bar);
    column3(o.vertex_bar, v) = p_bar;
    column3(o.vertex_normal_bar, v) = normalize_adjoint(normal.n, normal.length, n_bar);
  }
};

/// Gradient by a vertex: the sum over its corners.
struct GatherVertex {
  ObjectiveView o;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const {
    Eigen::Vector3d sum(0.0, 0.0, 0.0);
    if (!o.facets()) sum = column3(o.vertex_bar, v);
    const MeshView& mesh = o.mesh;
    for (auto c = mesh.vertex_corner_begin[v]; c < mesh.vertex_corner_begin[v + 1]; ++c) {
      const std::int32_t corner = mesh.vertex_corners[c];
      const Corners& bar = o.corner_bar[corner / 3];
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
