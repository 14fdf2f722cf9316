// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "cam/cam_options.h"
#include "core/compute/work_estimate.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// What make_cut() is about to take: time, bytes of programs, and memory for the ways of the
/// finishing ball where the part is rendered. From area, pitch, tolerances, passes and sample
/// spacing alone, so good to a factor of three or so: surfaces differ in how often they bend.
/// @param threads  that work at the same time, ≥ 1. @pre validate() passed.
WorkEstimate estimate_cut(const CamOptions& options, const OpticalSetup& setup, int threads);

/// More than anybody waits for or a controller stores: six weeks of one processor core, 100 GB.
inline constexpr double kMaxCutSeconds = 1000.0 * 3600.0;
inline constexpr double kMaxCutBytes = 1e11;

/// @throw InputError naming --pitch, --sample-spacing or what else asks for most, and a value that
///        would fit, if the disk of `folder` or the memory do not hold what the cut takes, or if it
///        takes more than kMaxCutSeconds of one core or kMaxCutBytes of programs.
void require_room_for_cut(const CamOptions& options, const OpticalSetup& setup,
                          const WorkEstimate& estimate, const std::filesystem::path& folder);

}  // namespace lensforge
