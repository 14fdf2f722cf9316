// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/render/source_picture.h"
#include "design/schedule/level_plan.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// What a design is to do, at full size; no step changes it.
struct DesignTask {
  const DesignOptions& options;
  const RunControl& control;
  Executor executor;  ///< Stops when the control does.
  Image target;       ///< Working picture.
  OpticalSetup setup;
  std::vector<Level> levels;
  std::optional<SourceLimit> limit;  ///< Of an extended source.
};

/// The picture at the size that the options ask for. @throw Interrupted
Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run);

/// Options and control must outlive the task.
/// @param target  linear light, any size.
/// @pre validate(options, target) passes. @throw Interrupted
DesignTask make_task(const Image& target, const DesignOptions& options, const Executor& executor,
                     const RunControl& control);

/// What is to be solved at one resolution.
struct LevelProblem {
  OpticalSetup setup;
  Image target;
  Image aim;  ///< What transport makes: under an extended source the light that is best blurred.
  ObjectiveOptions objective;
};

/// @param triangles  of the level's mesh; a spline's follow from its nodes.
LevelProblem make_problem(const DesignTask& task, const Level& level, std::int64_t triangles);

}  // namespace lensforge
