// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "design/reflect/normals/normal_objective.h"

namespace lensforge::reflect {

/// Lowers the objective face by face. But for light by way of other faces its normals do not depend
/// on each other, so that each takes a step of its own length: the gradient over its Gauss–Newton
/// curvature, doubled after a step that lowered the face's share of the objective and a quarter
/// after one that did not, which is taken back.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd descended_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start,
                                   int steps, const Executor& executor);

/// Tilts faces up or down, whichever way they look already, where that lowers their share of the
/// objective. A face that looks straight into the band has no slope to follow, since the light that
/// it sends back stays the same until it has turned by some 12°.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd tilted_by_face(const NormalObjective& objective, const Eigen::Matrix3Xd& start);

}  // namespace lensforge::reflect
