// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_lens.h"

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/spectral_color.h"
#include "core/io/checkpoint_file.h"
#include "core/optics/light_colors.h"
#include "core/surface/lens_surface.h"
#include "core/surface/spline_file.h"
#include "design/optics/made_surface.h"
#include "design/picture_values.h"
#include "design/render_lens.h"
#include "design/schedule/checkpoint.h"
#include "design/schedule/levels.h"
#include "design/schedule/rounds.h"

namespace lensforge {
namespace {

/// Lowers or lifts the surface so that its thinnest place is `thickness` above the entry face.
void rest_on_thickness(SurfaceMesh& mesh, double thickness) {
  mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
}

/// The surface of a design, finished or not: before its last level a spline is a smooth mesh.
void take_surface(const DesignTask& task, SurfaceMesh mesh, Lens& lens) {
  const Level& last = task.levels.back();
  if (last.spline && mesh.grid == last.grid) {
    lens.model = SurfaceModel::kSpline;
    lens.spline = settled({mesh.grid, std::move(mesh.vertices)}, task.options.thickness);
    lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
    return;
  }
  lens.model = last.spline ? SurfaceModel::kSmooth : task.options.model;
  lens.surface = std::move(mesh);
  rest_on_thickness(lens.surface, task.options.thickness);
}

/// @param look  at its pictures.
Lens make_lens(const DesignTask& task, SurfaceMesh mesh, Look look, const Executor& executor) {
  Lens lens;
  take_surface(task, std::move(mesh), lens);
  lens.setup = task.setup;
  lens.target = task.target;
  for (const SurfaceModel model : models_of(lens)) {
    Image* const render = model == lens.model ? &lens.render : nullptr;
    lens.metrics[model] = evaluate(lens, model, render, executor, look);
  }
  if (task.limit) lens.source_limit = task.limit->metrics;
  return lens;
}

/// By the design's own account of cutting and polishing.
std::optional<DesignResult::Made> made_part(const DesignOptions& options, const Lens& lens,
                                            const Executor& executor) {
  if (!options.made_by || !lens.spline) return std::nullopt;
  const int samples = samples_for(kPictureNodes, static_cast<double>(lens.spline->cell_count()));
  const SampledSurface part = made_nodes(*lens.spline, *options.made_by, samples, executor);
  DesignResult::Made made;
  made.metrics =
      evaluate(part.mesh, part.normals, lens.setup, lens.target, &made.picture, executor);
  return made;
}

std::optional<DesignResult::Colors> colors_of(const Lens& lens, const Executor& executor) {
  const Spectrum& spectrum = lens.setup.spectrum;
  if (spectrum.none()) return std::nullopt;
  std::vector<Image> pictures;
  for (const LightColor& color : light_colors(lens.setup)) {
    std::vector<double> flux = flux_of_lens(lens, color.setup, executor);
    for (double& value : flux) value *= lens.target.total();
    pictures.push_back(image_of(flux, lens.target.columns(), lens.target.rows()));
  }
  return DesignResult::Colors{color_picture(pictures, spectrum.wavelengths, spectrum.powers),
                              fringe_of(lens)};
}

/// @throw InputError if the surface of a checkpoint is none that a lens can have: its bytes were
/// changed.
void require_surface(const DesignTask& task, const Checkpoint& state) {
  Lens lens;
  take_surface(task, state.mesh, lens);
  const std::optional<std::string> fault = lens.spline ? spline_fault(*lens.spline, task.setup)
                                                       : surface_fault(lens.surface, task.setup);
  if (fault) refuse_checkpoint(task.options.checkpoint, "holds a surface of no lens: " + *fault);
}

bool run_all(const DesignTask& task, DesignLog& log, Checkpoint& state) try {
  return run_levels(task, log, state);
} catch (const InputError&) {
  // Resumed, it could only fail again, and it would be in the way of better options.
  std::error_code ignored;
  if (!task.options.resume) std::filesystem::remove(task.options.checkpoint, ignored);
  throw;
}

/// The lens after the last level and all that is said of it. @throw Interrupted
DesignResult finished(const DesignTask& task, const DesignLog& log, const SurfaceMesh& mesh) {
  log.report_rendering();
  DesignResult result;
  result.status = DesignResult::Status::kDone;
  result.lens = make_lens(task, mesh, Look::kThorough, task.executor);
  if (task.limit) result.source = check_source(result.lens, task.executor);
  result.colors = colors_of(result.lens, task.executor);
  result.made = made_part(task.options, result.lens, task.executor);
  return result;
}

/// The lens that there is when the design is interrupted: nobody wants to wait for it.
DesignResult unfinished(const DesignTask& task, SurfaceMesh mesh, const Executor& executor) {
  DesignResult result;
  result.message = "interrupted";
  result.lens = make_lens(task, std::move(mesh), Look::kBrief, executor);
  return result;
}

DesignResult run_to_end(const DesignTask& task, DesignLog& log, Checkpoint& state,
                        const Executor& executor) {
  if (run_all(task, log, state)) {
    try {
      return finished(task, log, state.mesh);
    } catch (const Interrupted&) {
      // Resumed, it goes on from the last level's end.
    }
  }
  return unfinished(task, std::move(state.mesh), executor);
}

}  // namespace

DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control) {
  validate(options, target);
  const DesignOptions settled = with_smoothness_applied(options);
  const DesignTask task = make_task(target, settled, executor, control);
  Checkpoint state = first_state(task);
  if (settled.resume) require_surface(task, state);
  DesignLog log(task, state);
  DesignResult result = run_to_end(task, log, state, executor);
  const bool done = result.status == DesignResult::Status::kDone;
  if (done) result.message = "all levels done" + log.remark();
  result.fingerprint = state.fingerprint;
  result.convergence = std::move(state.convergence);
  // Rounds that stopped early leave work over.
  if (done) log.report_done();
  return result;
}

std::uint64_t design_identity(const Image& target, const DesignOptions& options) {
  return design_fingerprint(working_picture(target, options, {}), options);
}

}  // namespace lensforge
