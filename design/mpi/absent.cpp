// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/session.h"
#include "design/schedule/guided_optimization.h"

/// A build without MPI: there is one process.
namespace lensforge {

int rank_count() { return 1; }

int ranks_here() { return 1; }

int run_on_ranks(const std::function<int()>& first) { return first(); }

std::unique_ptr<GuidedStage> make_stage_on_ranks(const SurfaceMesh& /*mesh*/,
                                                 const OpticalSetup& /*setup*/, double /*aspect*/,
                                                 const DesignGoal& /*goal*/,
                                                 const ObjectiveOptions& /*options*/,
                                                 const Executor& /*executor*/) {
  return nullptr;
}

}  // namespace lensforge
