// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/compute/work_estimate.h"
#include "design/design_options.h"

namespace lensforge {

/// What a design of a picture of `columns` x `rows` pixels is about to take on `threads` threads of
/// the CPU. Assumes that every round uses all its iterations.
/// @param share  of an optimisation that takes memory on this machine, 1 but for several (MPI).
/// @pre the options are in their ranges.
WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads,
                             double share = 1.0);

/// The same. @throw InputError with the --pixels that would fit, if any would, where the disk of
///        `folder` or the memory do not hold it.
WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder,
                                     double share = 1.0);

/// What a rendering of so many pixels takes, its comparison with a target and its file.
WorkEstimate rendering_work(double pixels);

}  // namespace lensforge
