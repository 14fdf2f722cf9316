// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/alternation.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/surface/control_net.h"
#include "core/value_slope.h"
#include "design/render.h"
#include "design/render/render_flux.h"
#include "design/render/source_picture.h"
#include "design/schedule/level_start.h"
#include "design/schedule/start_surface.h"

namespace lensforge {
namespace {

/// Of a design that is not the task's: the model, where that alone is another one, as after a
/// change of its default.
std::string owner_of(const Checkpoint& saved, const DesignTask& task) {
  for (const SurfaceModel model : kSurfaceModels) {
    DesignOptions options = task.options;
    options.model = model;
    if (design_fingerprint(task.target, options) != saved.fingerprint) continue;
    return "a design of --model " + model_name(model) + ": give that option with --resume";
  }
  return "another picture or other options";
}

Checkpoint resumed(const DesignTask& task, std::uint64_t fingerprint) {
  Checkpoint saved = read_checkpoint(task.options.checkpoint);
  if (saved.fingerprint != fingerprint) {
    throw InputError("checkpoint '" + task.options.checkpoint.string() + "' belongs to " +
                     owner_of(saved, task));
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

/// True if the surface is so near to its picture that what the optimiser's account of it gets wrong
/// counts: the convolution with a source, and the few rays of a spline. The part that a process
/// makes is blurred by more than either, and not corrected.
bool needs_correction(const LevelProblem& problem, const Level& level, const Checkpoint& state) {
  if (problem.objective.made_by) return false;
  return level.spline || (!problem.setup.extent.none() && state.round > 0);
}

/// Nodes a knot cell each way of the picture that a spline is corrected to. The error of few nodes
/// falls with their square: with 6 a ninth is left of that of 2.
constexpr int kCorrectionSamples = 6;

/// The picture that the level's surface has to aim at now.
Image corrected_target(const DesignTask& task, const LevelProblem& problem, const Level& level,
                       const SurfaceMesh& mesh, const Image& target) {
  const ControlNet net{mesh.grid, mesh.vertices};
  const auto picture = [&](int samples) {
    return [&, samples](const OpticalSetup& light) {
      if (level.spline) return render_spline(net, samples, light, task.executor);
      return flux_of_surface(mesh, light, problem.objective.model, task.executor);
    };
  };
  const PointPicture seen = picture(kMeshSamples);
  if (problem.setup.extent.none()) {
    return corrected(target, picture_under(problem.setup, 1, picture(kCorrectionSamples)),
                     picture_under(problem.setup, 1, seen));
  }
  return corrected_for_convolution(target, problem.setup, mesh.vertices.row(2).mean(), seen,
                                   task.executor);
}

/// @return false if it was asked to stop.
bool run_level(const DesignTask& task, DesignLog& log, Checkpoint& state) {
  const Level& level = task.levels[static_cast<std::size_t>(state.level)];
  state.mesh = level_start(task, level, state.mesh);
  LevelProblem problem = make_problem(task, level, state.mesh.triangle_count());
  const Image target = problem.target;
  std::unique_ptr<GuidedOptimization> stage;
  while (state.round < level.rounds) {
    const bool corrects = needs_correction(problem, level, state);
    if (corrects) problem.target = corrected_target(task, problem, level, state.mesh, target);
    if (corrects || !stage) {
      stage.reset();  // There is not always room for two.
      stage = std::make_unique<GuidedOptimization>(state.mesh, problem.setup, problem.target,
                                                   problem.objective, task.executor);
    }
    if (corrects) state.value = stage->value(state.mesh);
    if (!run_round({task, level, problem, *stage, log}, state)) return false;
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
