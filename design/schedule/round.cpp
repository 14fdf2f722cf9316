// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/round.h"

#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/surface/grid_mesh.h"
#include "core/text/number_text.h"
#include "core/value_slope.h"
#include "design/schedule/reach.h"
#include "design/schedule/transport_step.h"

namespace lensforge {
namespace {

/// A round that lowers the objective by less than this share has brought nothing.
constexpr double kIdleRound = 1e-3;

/// Pairs that L-BFGS keeps. MAE in thousandths after 6 × 100 iterations with 8 and 20 at 128²:
/// facets, portrait 2.54 and 2.52, logo 0.222 and 0.195; smooth, see kMergedRounds; 40 are no
/// better, 3 are worse.
constexpr int kHistory = 20;

/// Steps in which a mesh that a new level's barriers refuse is drawn back to the even grid.
constexpr int kRelaxSteps = 10;

/// Draws the mesh's x and y back towards the even grid until no barrier refuses it.
void relax(const LevelSite& site, SurfaceMesh& mesh) {
  const SurfaceMesh flat = make_grid_mesh(site.task.setup.lens_size, mesh.grid, 0.0);
  const SurfaceMesh fine = mesh;
  for (int step = 1; !std::isfinite(site.stage.value(mesh)) && step <= kRelaxSteps; ++step) {
    const double share = static_cast<double>(step) / kRelaxSteps;
    mesh.vertices.topRows<2>() =
        (1.0 - share) * fine.vertices.topRows<2>() + share * flat.vertices.topRows<2>();
  }
}

/// @param aimed  the first surface, before its mesh was relaxed.
[[noreturn]] void refuse_unreachable(const LevelSite& site, const AimedMesh& aimed) {
  site.log.report("searching for a focal length that works", 0);
  const DesignOptions& options = site.task.options;
  const LevelProblem& problem = site.problem;
  const std::optional<double> focal_length =
      reachable_focal_length({aimed.mesh, aimed.wanted, problem.setup, problem.target,
                              problem.objective, options.thickness},
                             site.task.executor);
  const std::string advice =
      focal_length ? "--focal " + number_text(*focal_length) + "mm would do"
                   : "no focal length up to " + number_text(kMaxFocalLength) + " mm would do";
  throw InputError("--focal " + number_text(options.focal_length) +
                   ": no lens of this width and index bends the light so far in so short a "
                   "distance; " +
                   advice);
}

/// The first half of a round: a mesh that transport aims, and that no barrier refuses.
void start_from_transport(const LevelSite& site, Checkpoint& state) {
  const bool first = state.level == 0 && state.round == 0;
  const bool shapes = first && site.task.options.spread > 0.0;
  const std::optional<AimedMesh> aimed =
      transport_step(site.task, site.problem, state.mesh, shapes, site.log);
  if (aimed) {
    state.mesh = aimed->mesh;
  } else {
    state.transporting = false;
    site.log.ended_early("transport", "it found no place for the light");
  }
  relax(site, state.mesh);
  if (aimed && first && !std::isfinite(site.stage.value(state.mesh))) {
    refuse_unreachable(site, *aimed);
  }
}

/// The rendering-guided half.
Ending follow_picture(const LevelSite& site, const GuidedOptimization::Observer& observe,
                      Checkpoint& state) {
  LbfgsOptions optimizer;
  optimizer.max_iterations = site.level.iterations;
  optimizer.history = kHistory;
  const LbfgsSummary summary = site.stage.run(optimizer, observe, state.scales, state.mesh);
  using Status = LbfgsSummary::Status;
  return {summary.status == Status::kStopped,
          summary.status == Status::kInfeasibleStart ? summary.message : ""};
}

/// Both halves and what follows from them.
Ending alternate(const LevelSite& site, const SurfaceMesh& before,
                 const GuidedOptimization::Observer& observe, Checkpoint& state) {
  const DesignOptions& options = site.task.options;
  const bool transports =
      !site.level.spline && state.transporting && state.round < options.transport_rounds;
  if (transports) {
    start_from_transport(site, state);
  } else if (!site.level.spline) {
    relax(site, state.mesh);
  }
  const bool rescaled = !state.scales.known();
  if (options.rendering_guided) {
    Ending ending = follow_picture(site, observe, state);
    if (ending.ended()) return ending;
  }
  conclude_round({before, site.stage.value(state.mesh), transports, rescaled}, site.level.rounds,
                 state);
  return {};
}

}  // namespace

Ending run_round(const LevelSite& site, Checkpoint& state) {
  const SurfaceMesh before = state.mesh;
  double reached = kInfinity;  // Objective of the last step.
  const GuidedOptimization::Observer log =
      site.log.observer(site.level.spline ? "spline" : "render");
  const auto observe = [&](int iteration, const ObjectiveEvaluation& step) {
    reached = step.energy.total;
    return log(iteration, step);
  };
  // A mesh that transport has aimed anew is often worse than the one before until it is optimised.
  const auto keep_the_better = [&] {
    if (!(reached <= state.value)) state.mesh = before;
  };
  try {
    Ending ending = alternate(site, before, observe, state);
    if (ending.stopped) keep_the_better();
    return ending;
  } catch (const Interrupted&) {
    keep_the_better();
    throw;
  }
}

void conclude_round(const RoundOutcome& outcome, int rounds, Checkpoint& state) {
  const bool idle = outcome.value >= (1.0 - kIdleRound) * state.value;
  if (outcome.value <= state.value) {
    state.value = outcome.value;
  } else {
    state.mesh = outcome.before;
  }
  if (idle) {
    state.transporting = false;
    state.scales = {};
  }
  const bool exhausted = idle && outcome.rescaled && !outcome.transported;
  state.round = exhausted ? rounds : state.round + 1;
}

}  // namespace lensforge
