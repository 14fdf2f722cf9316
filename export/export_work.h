// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/compute/work_estimate.h"

namespace lensforge {

/// What a height map of so many pixels takes, as grey PNG or as EXR.
WorkEstimate height_map_work(double pixels, bool grey);

/// What a rendering of so many pixels takes, its comparison with a target and its file.
WorkEstimate rendering_work(double pixels);

/// What a solid of splines with so many control points takes.
WorkEstimate spline_solid_work(double control_points);

/// The largest count below `wanted`, to two digits, for which the memory and the disk of `folder`
/// have room; 0 if there is none. @param work  grows with the count.
std::int64_t largest_with_room(const std::function<WorkEstimate(double)>& work, double wanted,
                               const std::filesystem::path& folder);

}  // namespace lensforge
