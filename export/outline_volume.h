// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/spline_net.h"

namespace lensforge {

/// Volume between a net of one patch and the face below it inside of the net's outline, mm³:
/// Gauss's rule in the knot cells inside; small triangles, clipped at the outline, in those that it
/// crosses; arcs are arcs. Right to 1e-7 of itself (OutlineVolume.IsTheIntegral).
/// @pre net.outline; one patch.
double outlined_volume(const SplineNet& net);

}  // namespace lensforge
