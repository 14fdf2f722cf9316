// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/schedule/guided_stage.h"

namespace lensforge {

/// The stage on all ranks, to be used by rank 0 while the others are in serve(); see the
/// constructor of GuidedStageOn. Null where one process does it as well: without other ranks, for a
/// spline, for a grid with too few rows for so many ranks, and in a build without MPI.
/// @param executor  its threads are those of each rank; its stop token ends all ranks' kernels.
std::unique_ptr<GuidedStage> make_stage_on_ranks(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                                 double aspect, const DesignGoal& goal,
                                                 const ObjectiveOptions& options,
                                                 const Executor& executor);

/// Does the parts of rank 0's stages until dismiss_ranks(). @pre not rank 0.
void serve_rank();

/// Lets the others' serve_rank() end. @pre rank 0; no stage on ranks lives.
void dismiss_ranks();

}  // namespace lensforge
