// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Vertices on each side over which levelling_factors() averages. Means over one only follow the
/// probes' noise (128² portrait, facets, MAE in thousandths after 600 iterations: 3.0, and 2.1 to
/// 2.4 with 2 to 8).
inline constexpr int kLevellingRadius = 6;

/// Bound of the factors and of their inverses.
inline constexpr double kMaxLevelling = 3.0;

/// How far vertices are to reach, beside what they do, for a preconditioned curvature that is about
/// the same everywhere on a grid. Reach enters that curvature twice.
/// @param squares  V squares, ≥ 0, of preconditioned curvatures as random probes have found them;
///                 their means over (2 kLevellingRadius + 1)² vertices count, fewer at the border.
/// @return V factors, about 1.
Eigen::ArrayXd levelling_factors(const Eigen::VectorXd& squares, const GridShape& shape);

}  // namespace lensforge
