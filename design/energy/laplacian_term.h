// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/executor.h"
#include "core/mesh_topology.h"

namespace lensforge {

/// E_lap = Σ over interior vertices of ‖P_U(v) − mean of P_U(neighbours)‖² (Sun et al., Eq. 16),
/// mm². Adds weight × derivative to x and y of `gradient` (3 × V), returns the value.
double laplacian_term(const Executor& executor, const Eigen::Matrix3Xd& vertices,
                      const MeshTopology& topology, double weight, Eigen::Matrix3Xd& gradient);

}  // namespace lensforge
