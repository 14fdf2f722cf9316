// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Measures of a mesh's faces, a column each.
struct Faces {
  Eigen::Matrix3Xd normal;  ///< Unit; zero for a face without area.
  Eigen::Matrix3Xd centroid;
  Eigen::VectorXd area;

  [[nodiscard]] Eigen::Index count() const { return area.size(); }
  /// Of the whole area: a_k = A_k/ΣA.
  [[nodiscard]] Eigen::VectorXd area_share() const { return area / area.sum(); }
};

Faces measure_faces(const SurfaceMesh& mesh);

/// Six times the signed volume between the mesh and the origin is the sum of the corners'
/// determinants; of a closed mesh this is the volume inside, positive if its faces look outwards.
double signed_volume(const SurfaceMesh& mesh);

/// Length of the diagonal of the axis-aligned bounding box.
double bounding_diagonal(const SurfaceMesh& mesh);

/// Every face cut in four at the middles of its edges: the same surface.
SurfaceMesh quartered(const SurfaceMesh& mesh);

}  // namespace lensforge::reflect
