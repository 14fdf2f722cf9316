// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/light/ray_scene.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {

/// Samples of the published algorithm (Tojo et al., 4.6).
inline constexpr int kPaperDirections = 16;  ///< N_dir of every face.
inline constexpr int kPaperPaths = 8;        ///< N_path of every direction.

/// Monte-Carlo estimate of the reflectivity energy's gradient by the faces' normals (Tojo et al.,
/// 4.2): random directions of the light, random points on the face, paths of one and two
/// reflections sampled by the lobe (Lafortune & Willems 1994), and unbiased radiative
/// back-propagation, whose paths are drawn anew (Nimier-David et al. 2020). Every number follows
/// from seed and face: the same bits for any number of threads.
class PathEstimator {
 public:
  /// @param mesh, field  must outlive it.
  PathEstimator(const SurfaceMesh& mesh, const LightField& field, Loss loss,
                const Executor& executor);

  /// An unbiased estimate of what ReflectionEnergy::value_and_gradient() returns for infinitely
  /// many directions, 3 × F, but for the inverse loss, whose slope is taken at an estimated
  /// radiance.
  /// @param normals  3 × F, unit. @throw Interrupted
  [[nodiscard]] Eigen::Matrix3Xd gradient(const Eigen::Matrix3Xd& normals,
                                          std::uint64_t seed) const;

 private:
  class Walker;

  const SurfaceMesh& mesh_;
  const LightField& field_;
  Loss loss_;
  Executor executor_;
  Faces faces_;
  Eigen::VectorXd share_;
  RayScene scene_;
};

}  // namespace lensforge::reflect
