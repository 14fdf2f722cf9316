// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/optics/front_surface.h"
#include "export/spline_net.h"

namespace lensforge {

/// Volume between a curved front and the plane z = 0 over a rectangle, mm³; counted below 0 where
/// the front lies below the plane. Exact but for rounding. @pre the front covers the rectangle.
double volume_below(const Front& front, const Eigen::AlignedBox2d& box);

/// A height map over its rectangle as one patch: the same surface, its knots fourfold at the ends.
SplinePatch patch_of(const HeightFront& front);

}  // namespace lensforge
