// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

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

/// What a file takes that is written to `out`.
/// @param work  by the value of the option that decides its size.
/// @throw InputError naming the option and the value that would fit if there is no room for it.
WorkEstimate require_room_for(const std::function<WorkEstimate(double)>& work,
                              const std::string& option, double value,
                              const std::filesystem::path& out);

}  // namespace lensforge
