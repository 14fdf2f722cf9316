// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/solid/spline_solid.h"

namespace lensforge {

/// The solid of a net of one patch that is cut along the net's outline: one optical face, a plane
/// for every straight wall, a cylinder for every quarter of a circle, and the face below.
/// @pre net.outline; no front that is a height map. @throw RunError if the outline leaves the
/// patch.
NamedSolid make_trimmed_solid(const SplineNet& net);

}  // namespace lensforge
