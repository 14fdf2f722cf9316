// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include "core/compute/cuda/launch.cuh"
#include "design/energy/objective_cuda.h"
#include "design/optimize/cuda/cuda_fourier.h"
#include "design/schedule/guided_stage_on.h"

namespace lensforge {

std::unique_ptr<GuidedStage> make_cuda_stage(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                             double aspect, const DesignGoal& goal,
                                             const ObjectiveOptions& options,
                                             const Executor& executor) {
  return std::make_unique<GuidedStageOn<CudaExecutor>>(mesh, setup, aspect, goal, options,
                                                       CudaExecutor(executor));
}

}  // namespace lensforge
