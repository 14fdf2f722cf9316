// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/work_estimate.h"

namespace lensforge {

/// What a height map of so many pixels takes, as grey PNG or as EXR.
WorkEstimate height_map_work(double pixels, bool grey);

/// What a solid of splines with so many control points takes.
WorkEstimate spline_solid_work(double control_points);

}  // namespace lensforge
