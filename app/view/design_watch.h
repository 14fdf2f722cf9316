// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

#include "app/view/live_server.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_model.h"

namespace lensforge {

/// What a design is to reach.
struct DesignGoalView {
  Image target;  ///< Working picture, linear light.
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kSmooth;
};

/// The state of a running design by what it has saved after its last round: its picture at the full
/// size, that picture's error, and every step so far.
/// @param number  of the state. @throw InputError if the checkpoint cannot be read.
LiveState state_of_design(const std::filesystem::path& checkpoint, const DesignGoalView& goal,
                          std::int64_t number, const Executor& executor);

}  // namespace lensforge
