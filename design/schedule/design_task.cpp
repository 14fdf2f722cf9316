// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/design_task.h"

#include <utility>

#include "core/image/image_io.h"
#include "core/surface/control_net.h"
#include "design/setup/light_setup.h"

namespace lensforge {
Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run) {
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  return resample(target, pixels.x(), pixels.y(), run);
}

DesignTask make_task(const Image& target, const DesignOptions& options, const Executor& executor,
                     const RunControl& control) {
  // Nothing is reported before all input has been accepted.
  Image working = working_picture(target, options, {control.stop_token(), {}});
  const Eigen::Vector2i pixels(working.columns(), working.rows());
  DesignTask task{options,
                  control,
                  executor.with_stop(control.stop_token()),
                  std::move(working),
                  optical_setup(options, pixels),
                  plan_levels(pixels, options),
                  std::nullopt};
  if (!task.setup.extent.none()) {
    task.limit = source_limit(task.target, task.setup, options.thickness, task.executor);
  }
  return task;
}

LevelProblem make_problem(const DesignTask& task, const Level& level, std::int64_t triangles) {
  LevelProblem problem;
  problem.setup = task.setup;
  problem.setup.pixels = level.pixels;
  problem.target = resample(task.target, level.pixels.x(), level.pixels.y());
  problem.aim =
      task.limit ? resample(task.limit->light, level.pixels.x(), level.pixels.y()) : problem.target;
  problem.objective.weights = task.options.weights;
  problem.objective.model = task.options.model;
  problem.objective.nu = level.nu;
  problem.objective.surface_height = task.options.thickness;
  if (level.spline) {
    // Smoothness is the spline's own; barriers are those of the triangles between its nodes.
    problem.objective.weights.smooth = 0.0;
    problem.objective.samples = kMeshSamples;
    problem.objective.made_by = task.options.made_by;
    const double cells = (level.grid.columns - 3.0) * (level.grid.rows - 3.0);
    triangles = static_cast<std::int64_t>(2.0 * kMeshSamples * kMeshSamples * cells);
  } else if (task.options.model == SurfaceModel::kSpline) {
    problem.objective.model = SurfaceModel::kSmooth;
  }
  problem.objective.area = default_area_barrier(problem.setup, triangles, level.least_area);
  return problem;
}

}  // namespace lensforge
