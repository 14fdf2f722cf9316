// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/compute/work_estimate.h"
#include "design/design_options.h"

namespace lensforge {

/// What a design of a picture of `columns` x `rows` pixels is about to take on `threads` threads of
/// the CPU. Assumes that every round uses all its iterations.
/// @pre the options are in their ranges.
WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads);

/// The same. @throw InputError with the --pixels that would fit if the disk of `folder` or the
///        memory do not hold it.
WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder);

}  // namespace lensforge
