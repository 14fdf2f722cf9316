// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/round.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "design/schedule/level_start.h"
#include "design/schedule/reach.h"
#include "design/schedule/start_surface.h"
#include "design/schedule/transport_step.h"

namespace lensforge {
namespace {

/// A round that lowers the objective by less than this share has brought nothing.
constexpr double kIdleRound = 1e-3;

/// Pairs that L-BFGS keeps. MAE in thousandths after 6 × 100 iterations with 8 and 20 at 128²:
/// facets, portrait 2.54 and 2.52, logo 0.222 and 0.195; smooth, see kMergedRounds; 40 are no
/// better, 3 are worse.
constexpr int kHistory = 20;

/// Draws the first `coordinates` of x, y and z back towards the surface that designs start from
/// until no barrier refuses the mesh. @return false if one still does.
bool relax(const LevelSite& site, int coordinates, SurfaceMesh& mesh) {
  if (std::isfinite(site.stage.value(mesh))) return true;
  const DesignTask& task = site.task;
  const SurfaceMesh start =
      start_surface(task.setup, mesh.grid, task.options.thickness, task.executor);
  return draw_towards(start, coordinates, site.stage, mesh);
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

/// Not even the surface that designs start from is allowed. A screen that is not tilted meets the
/// light of any source behind a flat front.
[[noreturn]] void refuse_start(const DesignTask& task) {
  const Eigen::Vector2d& tilt = task.options.light.screen_tilt;
  const bool front = task.setup.front.has_value();
  const std::string given =
      front ? "--front" : "--screen-tilt " + number_text(tilt.x()) + "," + number_text(tilt.y());
  throw InputError(given +
                   ": light of the surface that designs start from is reflected totally or passes "
                   "the screen by; " +
                   (front ? "--front flat" : "--screen-tilt 0,0") + " would do");
}

/// What transport does to the mesh's x and y. Later rounds keep what optimisation has made of them.
MeshShaping shaping_of(const DesignOptions& options, const Checkpoint& state) {
  if (options.spread == 0.0 || state.round > 0) return MeshShaping::kNone;
  return state.level == 0 ? MeshShaping::kSpread : MeshShaping::kCreases;
}

/// The first half of a round: a mesh that transport aims, or the one before where transport finds
/// none that the barriers allow.
void start_from_transport(const LevelSite& site, Checkpoint& state) {
  const std::optional<AimedMesh> aimed = transport_step(
      site.task, site.problem, state.mesh, shaping_of(site.task.options, state), site.log);
  if (aimed) {
    SurfaceMesh mesh = aimed->mesh;
    if (relax(site, 2, mesh)) {
      state.mesh = std::move(mesh);
      return;
    }
    if (state.level == 0 && state.round == 0) refuse_unreachable(site, *aimed);
  }
  state.transporting = false;
  site.log.ended_early("transport", aimed ? "no surface sends the light as far as it asks for"
                                          : "it found no place for the light");
}

/// The rendering-guided half. @return false if it was asked to stop.
bool follow_picture(const LevelSite& site, const GuidedOptimization::Observer& observe,
                    Checkpoint& state) {
  LbfgsOptions optimizer;
  optimizer.max_iterations = site.level.iterations;
  optimizer.history = kHistory;
  const LbfgsSummary summary = site.stage.run(optimizer, observe, state.scales, state.mesh);
  using Status = LbfgsSummary::Status;
  if (summary.status == Status::kInfeasibleStart) refuse_start(site.task);
  return summary.status != Status::kStopped;
}

/// Both halves and what follows from them. @return false if it was asked to stop.
bool alternate(const LevelSite& site, const SurfaceMesh& before,
               const GuidedOptimization::Observer& observe, Checkpoint& state) {
  const DesignOptions& options = site.task.options;
  const bool transports =
      !site.level.spline && state.transporting && state.round < options.transport_rounds;
  if (transports) start_from_transport(site, state);
  if (!site.level.spline && !relax(site, 2, state.mesh)) relax(site, 3, state.mesh);
  const bool rescaled = !state.scales.known();
  if (options.rendering_guided && !follow_picture(site, observe, state)) return false;
  conclude_round({before, site.stage.value(state.mesh), transports, rescaled}, site.level.rounds,
                 state);
  return true;
}

}  // namespace

bool run_round(const LevelSite& site, Checkpoint& state) {
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
    const bool finished = alternate(site, before, observe, state);
    if (!finished) keep_the_better();
    return finished;
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
