// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "design/objective_setups.h"
#include "design/schedule/guided_stage_on.h"

namespace lensforge::testing {

inline DesignGoal goal_of(Goal goal) {
  return goal == Goal::kPicture ? DesignGoal(target()) : DesignGoal(correspondence());
}

/// The numerical half of a guided optimisation of the rough mesh.
template <class Exec>
std::unique_ptr<GuidedStage> stage_on(SurfaceModel model, Goal goal, const Exec& executor,
                                      const OpticalSetup& setup = kSetup) {
  return std::make_unique<GuidedStageOn<Exec>>(rough_mesh(), setup, 1.0, goal_of(goal),
                                               options_of(model, ObjectiveWeights{}), executor);
}

}  // namespace lensforge::testing
