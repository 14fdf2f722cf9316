// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// How far from the surface rays begin, as a share of the mesh's diagonal: 30 times the rounding of
/// the single precision that Embree works in.
inline constexpr double kRayOffset = 1e-5;

/// Where a ray met the mesh.
struct RayHit {
  int face = -1;  ///< −1 if it met nothing.
  double distance = 0.0;

  [[nodiscard]] bool met() const { return face >= 0; }
};

/// Rays against a triangle mesh, by Embree. Safe to ask from several threads; the answers do not
/// depend on their number.
class RayScene {
 public:
  explicit RayScene(const SurfaceMesh& mesh);

  /// The first face that the ray from p along the unit vector w meets, from either side.
  [[nodiscard]] RayHit nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& w) const;

  /// Whether a face stands between p and the distance `reach` (infinite: anywhere) along w.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& p, const Eigen::Vector3d& w,
                             double reach) const;

  /// A point on the surface, moved out along the normal so that rays do not meet its own face.
  [[nodiscard]] Eigen::Vector3d lifted(const Eigen::Vector3d& p, const Eigen::Vector3d& n) const {
    return p + offset_ * n;
  }

 private:
  struct Handles;
  std::shared_ptr<const Handles> handles_;
  double offset_ = 0.0;
};

}  // namespace lensforge::reflect
