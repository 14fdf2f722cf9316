// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/alternation.h"

#include <cstddef>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/surface/control_net.h"
#include "core/value_slope.h"
#include "design/flux_of_surface.h"
#include "design/schedule/level_start.h"
#include "design/schedule/start_surface.h"
#include "design/source_picture.h"

namespace lensforge {
namespace {

Checkpoint resumed(const DesignTask& task, std::uint64_t fingerprint) {
  Checkpoint saved = read_checkpoint(task.options.checkpoint);
  if (saved.fingerprint != fingerprint) {
    throw InputError("checkpoint '" + task.options.checkpoint.string() +
                     "' belongs to another picture or other options");
  }
  return saved;
}

void save(const DesignTask& task, const DesignLog& log, Checkpoint& state) {
  state.seconds = log.seconds();
  if (!task.options.checkpoint.empty()) write_checkpoint(state, task.options.checkpoint);
}

void begin_next_level(Checkpoint& state) {
  state.round = 0;
  state.value = kInfinity;
  state.transporting = true;
  state.scales = {};
  ++state.level;
}

/// True if the surface is so near to its picture that what the convolution gets wrong counts. The
/// part that a process makes is blurred by more than the source, and not corrected.
bool needs_correction(const LevelProblem& problem, const Level& level, const Checkpoint& state) {
  return !problem.setup.extent.none() && !problem.objective.made_by &&
         (level.spline || state.round > 0);
}

/// The picture that the level's surface has to aim at now.
Image corrected_target(const DesignTask& task, const LevelProblem& problem, const Level& level,
                       const SurfaceMesh& mesh, const Image& target) {
  SampledSurface nodes;
  if (level.spline) nodes = spline_nodes({mesh.grid, mesh.vertices}, kMeshSamples);
  const auto picture = [&](const OpticalSetup& light) {
    if (level.spline) return flux_of_surface(nodes.mesh, nodes.normals, light, task.executor);
    return flux_of_surface(mesh, light, problem.objective.model, task.executor);
  };
  return corrected_for_convolution(target, problem.setup, mesh.vertices.row(2).mean(), picture,
                                   task.executor);
}

/// @return false if it was asked to stop.
bool run_level(const DesignTask& task, DesignLog& log, Checkpoint& state) {
  const Level& level = task.levels[static_cast<std::size_t>(state.level)];
  state.mesh = level_start(task, level, state.mesh);
  LevelProblem problem = make_problem(task, level, state.mesh.triangle_count());
  const Image target = problem.target;
  const auto stage_of = [&] {
    return GuidedOptimization(state.mesh, problem.setup, problem.target, problem.objective,
                              task.executor);
  };
  GuidedOptimization stage = stage_of();
  while (state.round < level.rounds) {
    if (needs_correction(problem, level, state)) {
      problem.target = corrected_target(task, problem, level, state.mesh, target);
      stage = stage_of();
      state.value = stage.value(state.mesh);
    }
    if (!run_round({task, level, problem, stage, log}, state)) return false;
    if (state.round < level.rounds) save(task, log, state);
  }
  begin_next_level(state);
  save(task, log, state);
  return true;
}

}  // namespace

Checkpoint first_state(const DesignTask& task) {
  const std::uint64_t fingerprint = design_fingerprint(task.target, task.options);
  if (task.options.resume) return resumed(task, fingerprint);
  Checkpoint state;
  state.fingerprint = fingerprint;
  state.mesh =
      start_surface(task.setup, task.levels.front().grid, task.options.thickness, task.executor);
  return state;
}

bool run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state) try {
  if (!task.options.resume) save(task, log, state);
  while (state.level < static_cast<int>(task.levels.size())) {
    if (!run_level(task, log, state)) return false;
  }
  return true;
} catch (const Interrupted&) {
  return false;
}

}  // namespace lensforge
