// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "design/reflect/light/path_estimator.h"
#include "design/reflect/normals/normal_objective.h"

namespace lensforge::reflect {

/// The published update of target normals (Tojo et al., Algorithm 1): `steps` gradient steps of
/// fixed length with estimated gradients. Eq. 9 prints half of the energy's derivative, so that a
/// step with η = 200 on a surface of area 5 is t ← t − η (½ ∂E/∂t + 5 β a (t − n⁰)); it is taken
/// per unit of area, scaled to a mesh of kPaperFaces, so that it does not depend on the mesh's
/// resolution.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd stepped_normals(const PathEstimator& estimator, const NormalAnchor& anchor,
                                 const Eigen::VectorXd& area_share, const Eigen::Matrix3Xd& start,
                                 int steps, std::uint64_t seed);

/// Faces of the model that the paper's step is scaled for (Fig. 14).
inline constexpr double kPaperFaces = 5914.0;

}  // namespace lensforge::reflect
