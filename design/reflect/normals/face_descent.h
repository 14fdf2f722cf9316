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

/// Turns faces to where no slope leads, wherever that lowers their share of the objective. A face
/// that looks straight into the band sends back the same light until it has turned by some 12°: it
/// is tilted up or down, whichever way it looks already. A face that is to light a place is turned
/// so that it mirrors one of the lights there; beyond a lobe's width it would not find it.
/// @param start  unit normals, 3 × F. @return unit normals. @throw Interrupted
Eigen::Matrix3Xd turned_by_face(const NormalObjective& objective, const LightPaths& paths,
                                const Goal& goal, const Eigen::Matrix3Xd& start);

}  // namespace lensforge::reflect
