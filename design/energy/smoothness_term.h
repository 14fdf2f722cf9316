// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/face_fit.h"
#include "design/energy/mean_curvature.h"
#include "design/energy/objective_view.h"
#include "design/energy/weingarten.h"

/// E_face and the linear part of E_edge. Both are sums over faces of F = H²A + τ1 Σ w δ, each the
/// least over the face's own map. So the map does not count in the derivatives (envelope theorem),
/// nor does how the tangent basis is turned in its plane.
namespace lensforge {

/// Derivatives of one face's F. In single precision, since they are but added to others of the
/// same size: an evaluation waits for them to come from memory.
struct FaceBend {
  struct ByNeighbour {
    Eigen::Vector3f n;
    Eigen::Vector3f c;
  };
  ByNeighbour by_neighbours[3];  ///< Anything at the boundary.
  Eigen::Vector3f by_tilt;       ///< By the face's own normal, which tilts the basis.
  float by_area;                 ///< mm²
};

/// A face with the map that minimises its F. @pre frames are up to date.
struct FittedFace {
  const FaceFrame& frame;
  TangentBasis basis;
  WeingartenMap map;
  double area;                 ///< mm²
  NeighbourOffset offsets[3];  ///< Zero at the boundary.

  LF_HD FittedFace(const ObjectiveView& o, std::int64_t i)
      : frame(o.scratch.frames[i]), basis(frame.n) {
    const double doubled_area = frame.n.dot(area_normal(o.corners(i)));  // |N|, without its root
    area = 0.5 * doubled_area;
    FaceFit fit;
    for (int k = 0; k < 3; ++k) {
      const int j = o.mesh.neighbour(i, k);
      if (j < 0) continue;
      offsets[k] = NeighbourOffset(frame, basis, o.scratch.frames[j]);
      fit.add(offsets[k], o.weights.edge * o.scratch.edge_weights[3 * i + k]);
    }
    fit.add_mean_curvature(doubled_area);
    map = fit.solve();
  }
};

/// Weighted derivatives of a face's F; its shares of E_face and of Σ w h. @pre frames are up to
/// date.
struct BendFace {
  ObjectiveView o;

  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    const FittedFace face(o, i);
    const Eigen::Vector3d& n = face.frame.n;
    FaceBend& bend = o.scratch.bends[i];
    const ValueSlope curvature = mean_curvature_term(face.map, face.area);
    bend.by_area = static_cast<float>(o.weights.smooth * curvature.slope);
    Eigen::Vector2d tilt(0.0, 0.0);
    double edge = 0.0;
    for (int k = 0; k < 3; ++k) {
      const int j = o.mesh.neighbour(i, k);
      if (j < 0) continue;
      const FaceFrame& there = o.scratch.frames[j];
      const MismatchSlope slope(face.offsets[k], face.map);
      const double w = o.scratch.edge_weights[3 * i + k];
      const double scaled = o.weights.smooth * o.weights.edge * w;
      const Eigen::Vector3d by_n = scaled * face.basis.world(slope.by_n);
      const Eigen::Vector3d by_c = scaled * face.basis.world(slope.by_d);
      bend.by_neighbours[k] = {by_n.cast<float>(), by_c.cast<float>()};
      // A basis vector e tilts with the normal by −n (e·dn).
      const double along_d = scaled * n.dot(there.c - face.frame.c);
      const double along_n = scaled * n.dot(there.n);
      tilt.x() -= along_d * slope.by_d.x() + along_n * slope.by_n.x();
      tilt.y() -= along_d * slope.by_d.y() + along_n * slope.by_n.y();
      edge += w * slope.value;
    }
    bend.by_tilt = face.basis.world(tilt).cast<float>();
    return {curvature.value, edge};
  }
};

/// Derivatives of all faces' F by one face's frame and area. @pre bends are up to date.
LF_HD inline FaceFrame bend_adjoint(const ObjectiveView& o, std::int64_t face, double& area_bar) {
  const FaceBend& own = o.scratch.bends[face];
  FaceFrame bar;
  bar.n = own.by_tilt.cast<double>();
  for (int k = 0; k < 3; ++k) {
    const int j = o.mesh.neighbour(face, k);
    if (j < 0) continue;
    const FaceBend::ByNeighbour& there = o.scratch.bends[j].by_neighbours[o.mesh.edge_to(j, face)];
    bar.n += there.n.cast<double>();
    bar.c += there.c.cast<double>() - own.by_neighbours[k].c.cast<double>();
  }
  area_bar = own.by_area;
  return bar;
}

}  // namespace lensforge
