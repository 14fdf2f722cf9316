// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// What the smoothness terms need of a triangle: centroid c and unit normal n, n_z > −1 (Sun et
/// al., section 3.3). The same struct holds derivatives by these vectors.
struct FaceFrame {
  Eigen::Vector3d n{0.0, 0.0, 0.0};
  Eigen::Vector3d c{0.0, 0.0, 0.0};
};

LF_HD inline FaceFrame face_frame(const Corners& t) {
  const Eigen::Vector3d normal = area_normal(t);
  return {(1.0 / normal.norm()) * normal, (1.0 / 3.0) * (t.v0 + t.v1 + t.v2)};
}

/// Two unit vectors at right angles to each other and to a normal, e2 = n × e1 (Duff et al. 2017,
/// Building an Orthonormal Basis, Revisited). The paper takes e1 along an edge: which vectors of
/// the tangent plane they are changes none of the terms, since each face's map is fitted in them.
struct TangentBasis {
  Eigen::Vector3d e1;
  Eigen::Vector3d e2;

  /// @pre n_z > −1.
  LF_HD explicit TangentBasis(const Eigen::Vector3d& n) {
    const double share = 1.0 / (1.0 + n.z());
    const double mixed = -n.x() * n.y() * share;
    e1 = {1.0 - n.x() * n.x() * share, mixed, -n.x()};
    e2 = {mixed, 1.0 - n.y() * n.y() * share, -n.y()};
  }
  /// Coordinates of a vector's part in the tangent plane.
  [[nodiscard]] LF_HD Eigen::Vector2d local(const Eigen::Vector3d& v) const {
    return {e1.x() * v.x() + e1.y() * v.y() + e1.z() * v.z(),
            e2.x() * v.x() + e2.y() * v.y() + e2.z() * v.z()};
  }
  /// The vector of such coordinates.
  [[nodiscard]] LF_HD Eigen::Vector3d world(const Eigen::Vector2d& v) const {
    return {v.x() * e1.x() + v.y() * e2.x(), v.x() * e1.y() + v.y() * e2.y(),
            v.x() * e1.z() + v.y() * e2.z()};
  }
};

}  // namespace lensforge
