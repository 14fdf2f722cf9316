// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/alternation.h"

#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/surface/grid_mesh.h"

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

Ending run_level(const DesignTask& task, DesignLog& log, Checkpoint& state) {
  const Level& level = task.levels[static_cast<std::size_t>(state.level)];
  if (state.mesh.grid != level.grid) {
    state.mesh = regrid(state.mesh, task.setup.lens_size, level.grid);
  }
  const LevelProblem problem = make_problem(task, level, state.mesh.triangle_count());
  GuidedOptimization stage(state.mesh, problem.setup, problem.target, problem.objective,
                           task.executor);
  while (state.round < task.options.rounds) {
    Ending ending = run_round({task, problem, stage, log}, state);
    if (ending.ended()) return ending;
    if (state.round < task.options.rounds) save(task, log, state);
  }
  begin_next_level(state);
  save(task, log, state);
  return {};
}

}  // namespace

Checkpoint first_state(const DesignTask& task) {
  const std::uint64_t fingerprint = design_fingerprint(task.target, task.options);
  if (task.options.resume) return resumed(task, fingerprint);
  Checkpoint state;
  state.fingerprint = fingerprint;
  state.mesh =
      make_grid_mesh(task.setup.lens_size, task.levels.front().grid, task.options.thickness);
  return state;
}

Ending run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state) try {
  if (!task.options.resume) save(task, log, state);
  while (state.level < static_cast<int>(task.levels.size())) {
    Ending ending = run_level(task, log, state);
    if (ending.ended()) return ending;
  }
  return {};
} catch (const Interrupted&) {
  return {true, ""};
}

}  // namespace lensforge
