// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/surface/control_net.h"
#include "core/surface/sampled_surface.h"
#include "design/optics/made_by.h"

namespace lensforge {

/// What cutting and polishing make of a spline over an even grid (made_basis()), on an even grid of
/// its parameters. @param samples  nodes a knot cell each way, ≥ 1.
SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor);

/// The spline of the same grid that has to be cut so that the net's surface is what comes off the
/// machine, by least squares. A design that begins with it ends far better than one that begins
/// with the net: 128² portrait on 25 mm, pitch 0.045 mm, knots 0.05 mm apart, 80 iterations: MAE
/// 0.0038 for 0.0059; 240 iterations of the latter 0.0056.
/// @param least_share  is added to the squares of what cutting and polishing leave of a wave, > 0:
///                     waves of which less is left are sharpened less.
ControlNet unmade(ControlNet net, const MadeBy& made, double least_share);

}  // namespace lensforge
