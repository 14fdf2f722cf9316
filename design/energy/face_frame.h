// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"
#include "core/surface/corners.h"

namespace lensforge {

/// What the smoothness terms need of a triangle: centroid c, unit normal n and the first vector e1
/// of its tangent basis, the direction of its edge v0 → v1; e2 = n × e1 (Sun et al., section 3.3).
/// The same struct holds derivatives by these vectors.
struct FaceFrame {
  Eigen::Vector3d n{0.0, 0.0, 0.0};
  Eigen::Vector3d e1{0.0, 0.0, 0.0};
  Eigen::Vector3d c{0.0, 0.0, 0.0};
};

LF_HD inline FaceFrame face_frame(const Corners& t) {
  return {area_normal(t).normalized(), (t.v1 - t.v0).normalized(), (t.v0 + t.v1 + t.v2) / 3.0};
}

/// The part of face_frame()'s adjoint that goes through e1 and c: adds to the corners' derivatives.
LF_HD inline void tangent_adjoint(const Corners& t, const FaceFrame& frame, const FaceFrame& bar,
                                  Corners& grad) {
  const Eigen::Vector3d edge_bar = normalize_adjoint(frame.e1, (t.v1 - t.v0).norm(), bar.e1);
  const Eigen::Vector3d third = bar.c / 3.0;
  grad.v0 += third - edge_bar;
  grad.v1 += third + edge_bar;
  grad.v2 += third;
}

/// Adjoint of face_frame(): adds to the corners' derivatives.
LF_HD inline void face_frame_adjoint(const Corners& t, const FaceFrame& frame, const FaceFrame& bar,
                                     Corners& grad) {
  area_normal_adjoint(t, normalize_adjoint(frame.n, area_normal(t).norm(), bar.n), grad);
  tangent_adjoint(t, frame, bar, grad);
}

}  // namespace lensforge
