// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/io/checkpoint_file.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_check.h"
#include "core/lens/surface_field.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"
#include "core/optics/polish_transfer.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "design/render.h"
#include "design/render/source_picture.h"
#include "design/schedule/checkpoint.h"
#include "design/schedule/levels.h"
#include "design/schedule/rounds.h"
#include "design/schedule/two_faces.h"
#include "design/spline/made_surface.h"
#include "design/transport/semi_discrete.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

/// Moves the surface along z so that its minimum is `thickness` above the entry face.
void rest_on_thickness(SurfaceMesh& mesh, double thickness) {
  mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
}

/// Takes the surface of a finished or unfinished design: before its last level a spline is a smooth
/// mesh.
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

/// Reports the pictures of a lens by name; one that is empty reports nothing.
using PictureReports = std::function<RunControl(const std::string& picture)>;

/// @param look  effort of its pictures.
Lens make_lens(const DesignTask& task, SurfaceMesh mesh, Look look, const Executor& executor,
               const PictureReports& reports) {
  Lens lens;
  take_surface(task, std::move(mesh), lens);
  lens.setup = task.setup;
  lens.target = task.target;
  for (const SurfaceModel model : models_of(lens)) {
    Image* const render = model == lens.model ? &lens.render : nullptr;
    const RunControl control = reports ? reports("as " + model_name(model)) : RunControl();
    lens.metrics[model] = evaluate(lens, model, render, executor, look, control);
  }
  if (task.limit) lens.source_limit = task.limit->metrics;
  return lens;
}

/// Adds the haze of the roughness that a process leaves to its part's picture.
/// @param picture, metrics  of the part.
void add_haze(const MadeBy& process, const Lens& lens, Image& picture, ImageMetrics& metrics,
              const Executor& executor) {
  const Roughness roughness{process.roughness, process.correlation};
  if (roughness.none()) return;
  const double height = lens.surface.vertices.row(2).mean();
  const Haze haze = haze_of(roughness, lens.setup, height, middle_wavelength(lens.setup));
  const std::span<float> values = picture.values();
  const std::vector<double> clear(values.begin(), values.end());
  const std::vector<double> hazy = hazed(haze, clear, lens.setup.pixels, executor);
  std::transform(hazy.begin(), hazy.end(), values.begin(),
                 [](double value) { return static_cast<float>(value); });
  metrics = compare(picture, lens.target);
  metrics.flux_inside = picture.total() / lens.target.total();
}

std::optional<DesignResult::Colors> colors_of(const Lens& lens, const Executor& executor,
                                              const PictureReports& reports) {
  const Spectrum& spectrum = lens.setup.spectrum;
  if (spectrum.none()) return std::nullopt;
  std::vector<Image> pictures;
  for (const LightColor& color : light_colors(lens.setup)) {
    const RunControl control = reports("in colour " + std::to_string(pictures.size() + 1));
    std::vector<double> flux = flux_of_lens(lens, color.setup, executor, control);
    for (double& value : flux) value *= lens.target.total();
    pictures.push_back(image_of(flux, lens.target.columns(), lens.target.rows()));
  }
  return DesignResult::Colors{color_picture(pictures, spectrum.wavelengths, spectrum.powers),
                              fringe_of(lens)};
}

/// @throw InputError if no lens can have a checkpoint's surface: its bytes were changed.
void require_surface(const DesignTask& task, const Checkpoint& state) {
  Lens lens;
  take_surface(task, state.mesh, lens);
  const std::optional<std::string> fault = lens.spline ? spline_fault(*lens.spline, task.setup)
                                                       : surface_fault(lens.surface, task.setup);
  if (fault) refuse_checkpoint(task.options.checkpoint, "holds a surface of no lens: " + *fault);
}

/// Runs the steps of a design. One that is refused leaves no checkpoint: resuming would fail again,
/// and the checkpoint would refuse better options.
template <class Steps>
auto run_all(const DesignTask& task, const Steps& steps) try {
  return steps();
} catch (const InputError&) {
  std::error_code ignored;
  if (!task.options.resume) std::filesystem::remove(task.options.checkpoint, ignored);
  throw;
}

/// The lens after the last level, with its checks. @throw Interrupted
DesignResult finished(const DesignTask& task, const DesignLog& log, const SurfaceMesh& mesh) {
  const std::string what = "rendering the lens";
  log.report_rendering(what);
  const auto reports = [&](const std::string& picture) {
    return log.rendering(what + " " + picture);
  };
  DesignResult result;
  result.status = DesignResult::Status::kDone;
  result.lens = make_lens(task, mesh, Look::kThorough, task.executor, reports);
  if (task.limit) {
    result.source = check_source(result.lens, task.executor, log.rendering("checking the source"));
  }
  result.colors = colors_of(result.lens, task.executor, reports);
  if (!result.lens.spline) return result;
  const DesignOptions& options = task.options;
  if (options.made_by) {
    log.report_rendering("rendering the part");
    result.made = made_part(result.lens, *options.made_by, task.executor);
  }
  if (follows_waves(options, result.lens.setup)) {
    result.wall = wall_of(result.lens, options.made_by, wave_options(options, result.lens.setup),
                          task.executor, log.rendering("rendering the wall"));
  }
  return result;
}

/// The lens of an interrupted design, at Look::kBrief because nobody wants to wait for it.
DesignResult unfinished(const DesignTask& task, SurfaceMesh mesh, const Executor& executor) {
  DesignResult result;
  result.message = "interrupted";
  result.lens = make_lens(task, std::move(mesh), Look::kBrief, executor, {});
  return result;
}

DesignResult run_to_end(const DesignTask& task, DesignLog& log, Checkpoint& state,
                        const Executor& executor) {
  if (run_all(task, [&] { return run_levels(task, log, state); })) {
    try {
      return finished(task, log, state.mesh);
    } catch (const Interrupted&) {
      // Resuming continues after the last level.
    }
  }
  return unfinished(task, std::move(state.mesh), executor);
}

/// The lens of shape_two_faces().
Lens two_face_lens(const DesignTask& task, const Image& second, const TwoFaceResult& shaped,
                   Look look, const Executor& executor) {
  Lens lens;
  lens.model = SurfaceModel::kSpline;
  lens.spline = {shaped.net, shaped.faces.exit};
  lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
  lens.setup = task.setup;
  lens.setup.front = height_front(shaped.faces.front, task.setup.lens_size);
  lens.target = task.target;
  Lens far = lens;
  far.setup = on_second_screen(lens.setup);
  far.target = second;
  lens.second = {second, {}, {}};
  lens.second->metrics = evaluate(far, lens.model, &lens.second->render, executor, look);
  for (const SurfaceModel model : models_of(lens)) {
    Image* const render = model == lens.model ? &lens.render : nullptr;
    lens.metrics[model] = evaluate(lens, model, render, executor, look);
  }
  return lens;
}

/// A design of both faces. @throw InputError as shape_two_faces() does.
DesignResult design_two_faces(const DesignTask& task, const Executor& executor) {
  const Image second =
      working_picture(*task.options.second.picture, task.options, {task.control.stop_token(), {}});
  TwoFaceResult shaped = run_all(task, [&] { return shape_two_faces(task, second); });
  DesignResult result;
  result.message = "interrupted";
  result.fingerprint = shaped.fingerprint;
  result.convergence = std::move(shaped.convergence);
  if (shaped.done) {
    task.control.report({"design", 1.0, 1.0, "rendering the lens"});
    try {
      result.lens = two_face_lens(task, second, shaped, Look::kThorough, task.executor);
      result.status = DesignResult::Status::kDone;
      result.message = "both faces done";
      return result;
    } catch (const Interrupted&) {
      // Resuming continues after the last round.
    }
  }
  result.lens = two_face_lens(task, second, shaped, Look::kBrief, executor);
  return result;
}

}  // namespace

DesignResult::Made made_part(const Lens& lens, const MadeBy& process, const Executor& executor) {
  const int samples = samples_for(kPictureNodes, static_cast<double>(lens.spline->cell_count()));
  const SampledSurface part = made_nodes(*lens.spline, process, samples, executor);
  DesignResult::Made made;
  made.metrics =
      evaluate(part.mesh, part.normals, lens.setup, lens.target, &made.picture, executor);
  add_haze(process, lens, made.picture, made.metrics, executor);
  return made;
}

DesignResult::Wall wall_of(const Lens& lens, const std::optional<MadeBy>& process,
                           const WaveOptions& waves, const Executor& executor,
                           const RunControl& control) {
  const SplineSurface surface(*lens.spline);
  std::unique_ptr<const SurfaceField> field = std::make_unique<OpticalField>(surface);
  if (process) field = std::make_unique<MadeField>(*lens.spline, *process, executor);
  const SurfaceField* const one = field.get();
  std::vector<double> light =
      wave_flux(lens.setup, wave_grid(lens.setup, surface), {&one, 1}, waves, executor, control)
          .front();
  DesignResult::Wall wall;
  wall.wavelength = waves.wavelength;
  const double total = lens.target.total();
  for (double& pixel : light) pixel *= total;
  wall.picture = image_of(light, lens.target.columns(), lens.target.rows());
  wall.metrics = compare(wall.picture, lens.target);
  wall.metrics.flux_inside = wall.picture.total() / total;
  if (process) add_haze(*process, lens, wall.picture, wall.metrics, executor);
  return wall;
}

namespace {

/// Light of a single wavelength as that of one index, which transport goes by, too.
DesignOptions in_one_index(DesignOptions options) {
  Spectrum& spectrum = options.light.spectrum;
  if (spectrum.wavelengths.size() != 1) return options;
  options.light.wavelength_nm = spectrum.wavelengths[0];
  options.ior = Dispersion{options.ior, spectrum.abbe}.index_at(spectrum.wavelengths[0]);
  spectrum.wavelengths.clear();
  spectrum.powers.clear();
  return options;
}

/// σ to which a shared front is smoothed, as a share of the lens and of its thickness: finer detail
/// would gather light before the exit face, which makes it with little slope. At the edges the
/// front rises to them, so that all light enters within them, and that must not fold either.
constexpr double kFrontDetail = 1.0 / 50.0;
constexpr double kFrontDepth = 1.0 / 3.0;
/// Longer side of the picture that it is taken from, and its samples.
constexpr int kSharedPixels = 64;
constexpr int kFrontSamples = 200;
constexpr int kSharedIterations = 20;

/// The options of a lens whose exit face turns light half as much: by a flat front, to a wall twice
/// as far, from a point twice as far.
DesignOptions with_half_turn(DesignOptions options, const Eigen::Vector2d& size) {
  LightOptions& light = options.light;
  light.both_faces = false;
  if (const auto place = place_of_source(light, size)) {
    const Eigen::Vector3d middle(0.5 * size.x(), 0.5 * size.y(), 0.0);
    light.source_position = middle + 2.0 * (*place - middle);
    light.source_distance = 0.0;
  }
  light.source_angle = light.source_size = 0.0;
  light.source_picture.clear();
  light.source_shape = {};
  light.spectrum = {};
  light.model = LightModel::kRays;
  options.focal_length += options.focal_length - options.thickness;
  options.pixels = std::min(options.pixels, kSharedPixels);
  options.iterations = kSharedIterations;
  options.levels = 1;
  options.model = SurfaceModel::kSpline;
  options.made_by.reset();
  options.outline.reset();
  options.checkpoint.clear();
  options.resume = false;
  return options;
}

/// A front that turns light half as much as the lens has to: the mirror image of the exit face of
/// with_half_turn(), smoothed. @throw Interrupted
std::shared_ptr<const HeightSpline> shared_front(const Image& target, const DesignOptions& options,
                                                 const Executor& executor,
                                                 const RunControl& control) {
  control.report({"design", 0.0, 1.0, "shaping the front"});
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  const Eigen::Vector2d size = optical_setup(options, pixels).lens_size;
  const DesignOptions half = with_half_turn(options, size);
  try {
    validate(half, target);
  } catch (const InputError& error) {
    throw InputError("--faces two: the front has to turn light as a lens for a wall at " +
                     number_text(half.focal_length) + " mm does; " + error.what());
  }
  const DesignResult shaped = design_lens(target, half, executor, {control.stop_token(), {}});
  if (shaped.status != DesignResult::Status::kDone) throw Interrupted();
  const SplineSurface exit(*shaped.lens.spline);
  const double spacing = size.maxCoeff() / kFrontSamples;
  SurfacePatch patch;
  OpticalField(exit).sample(lens_grid(size, spacing), executor, patch);
  Image heights(static_cast<int>(patch.window.columns), static_cast<int>(patch.window.rows));
  for (int row = 0; row < heights.rows(); ++row) {
    for (int column = 0; column < heights.columns(); ++column) {
      const std::int64_t from_below = heights.rows() - 1 - row;
      heights.at(column, row) = static_cast<float>(
          -patch.z[static_cast<std::size_t>(from_below * heights.columns() + column)]);
    }
  }
  // Two blurs, of half the variance each.
  const double sigma = std::max(kFrontDetail * size.maxCoeff(), kFrontDepth * options.thickness);
  for (int k = 0; k < 2; ++k) heights = soften(heights, 0.5 * sigma / spacing, 0.0);
  HeightGrid grid{heights.columns(), heights.rows(), {}};
  const float highest = *std::ranges::max_element(heights.values());
  for (const float z : heights.values()) grid.heights.push_back(z - highest);
  return std::make_shared<const HeightSpline>(std::move(grid));
}

}  // namespace

DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control) {
  validate(options, target);
  DesignOptions settled = with_smoothness_applied(in_one_index(options));
  if (settled.light.both_faces) {
    settled.light.front_heights = shared_front(target, settled, executor, control);
    validate(settled, target);
  }
  const DesignTask task = make_task(target, settled, executor, control);
  if (settled.second.picture) return design_two_faces(task, executor);
  Checkpoint state = first_state(task);
  if (settled.resume) require_surface(task, state);
  DesignLog log(task, state);
  DesignResult result = run_to_end(task, log, state, executor);
  const bool done = result.status == DesignResult::Status::kDone;
  if (done) result.message = "all levels done" + log.remark();
  result.fingerprint = state.fingerprint;
  result.convergence = std::move(state.convergence);
  result.lens.setup.ior = options.ior;
  result.lens.setup.spectrum = options.light.spectrum;
  // Rounds that stopped early leave work over.
  if (done) log.report_done();
  return result;
}

std::uint64_t design_identity(const Image& target, const DesignOptions& options) {
  return design_fingerprint(working_picture(target, options, {}), in_one_index(options));
}

namespace {

/// Processor seconds per triangle, on 2 GHz cores: one iteration with facets or the smooth model
/// (measured at 256² and 512²), with a spline, per triangle between nodes (96² and 128²), and with
/// a spline for a process (64² and 128²); transport with the start of the mesh (5e-5 to 8e-5;
/// facets need two).
constexpr double kIterationSeconds = 5.1e-7;
constexpr double kSplineSeconds = 2.5e-7;
constexpr double kMadeSeconds = 1e-6;
constexpr double kTransportSeconds = 6e-5;
/// Of a picture in the light of one of a lamp's points, per triangle.
constexpr double kLampSeconds = 1.7e-7;
/// Relative cost of a smooth mesh's iteration in a lamp's light, which is blurred on parts of
/// pixels.
constexpr double kBlurred = 2.0;

/// Bytes per triangle: transport, optimisation of a mesh (512²: 1.12 GB) and of a spline (128²:
/// 0.57 GB), and files: surface and checkpoint, each twice while it is replaced.
constexpr double kTransportMemory = 2000.0;
constexpr double kMeshMemory = 1000.0;
constexpr double kSplineMemory = 500.0;
constexpr double kTriangleDisk = 120.0;
/// Bytes per triangle of the whole mesh on rank 0 of several machines (docs/scale.md).
constexpr double kWholeMemory = 200.0;

/// Bytes per pixel of the working picture: PNG, EXR and double copies.
constexpr double kPixelMemory = 100.0;
constexpr double kPixelDisk = 30.0;

/// Bytes of the program itself with its libraries.
constexpr double kBaseMemory = 1.6e8;

/// Relative cost of each further wavelength (64² portrait, smooth, whole designs: 5.9 s for one,
/// 9.5 s for three).
constexpr double kColorShare = 0.35;

/// Share of 100 iterations a round after which the picture is good enough (Finish), about. Of a
/// spline: 1 / (1 + kSeenSoon w²) where diffraction is w pixels wide, at most one; measured: 0.9,
/// 0.8 and 0.5 for w = 0.26, 0.52 and 1.04. Pictures differ: of 256², a photograph with deep blacks
/// takes half as long as the portrait.
constexpr double kSeenSoon = 1.25;
constexpr double kSmoothShare = 0.4;  ///< Of a smooth mesh.

/// Pictures by waves that an iteration takes: one, with its adjoint that of 1.3 more, and a seventh
/// more evaluations than iterations.
constexpr double kWavesPerIteration = 2.6;
/// Time of a design behind a front that it shapes, over that behind a flat one: every ray has to be
/// found through the front (portrait on 25 mm: 24 s in place of 5.2 with 64², 78 of 24 with 128²).
constexpr double kSharedFrontCost = 4.0;
/// Of a design for two pictures, per pixel and DesignOptions::iterations (relief and rings of 32²
/// and 64² on 25 mm: 15 and 64 s; nearly twice where it begins with plane faces).
constexpr double kTwoPicturesSeconds = 1.5e-4;
/// Bytes of the fields of waves.
constexpr double kWaveMemory = 2.5e9;

double iteration_seconds(const Level& level, const DesignOptions& options) {
  const std::size_t colors = std::max<std::size_t>(1, options.light.spectrum.wavelengths.size());
  const double growth = 1.0 + kColorShare * (static_cast<double>(colors) - 1.0);
  if (!level.spline) {
    return growth * (source_extent(options.light).none() ? 1.0 : kBlurred) * kIterationSeconds;
  }
  return growth * (options.made_by ? kMadeSeconds : kSplineSeconds);
}

/// Share of the iterations that a design makes, about.
double usual_share(const DesignOptions& options, const Eigen::Vector2i& pixels) {
  if (!options.ends_when_seen() || options.model == SurfaceModel::kFacet) return 1.0;
  const OpticalSetup setup = optical_setup(options, pixels);
  const double wavelength = wave_options(options, setup).wavelength;
  const double width =
      std::min(1.0, diffraction_width(setup, options.thickness, wavelength) / pixel_width(setup));
  const bool spline = options.model == SurfaceModel::kSpline;
  const double share = spline ? 1.0 / (1.0 + kSeenSoon * width * width) : kSmoothShare;
  return std::min(1.0, 100.0 / options.iterations * share);
}

/// Processor seconds of the pictures in the light of a lamp with a width, point by point: one a
/// round of the level, and at the end those of all models and one of half the points.
double lamp_seconds(const Level& level, bool last, double triangles, const DesignOptions& options) {
  const OpticalSetup setup = optical_setup(options, level.pixels);
  if (setup.extent.none()) return 0.0;
  double pictures = level.rounds;
  // A spline's last pictures have twice as many nodes each way.
  if (last) pictures += level.spline ? 4.0 * 1.5 : 2.5;
  return kLampSeconds * source_point_count(setup, options.thickness) * triangles * pictures;
}

/// Sites of a level's transports: those of the even mesh, for facets also their own.
double transport_sites(double triangles, const DesignOptions& options) {
  const double even = std::min(triangles, kMaxEvenFaces);
  return options.model == SurfaceModel::kFacet ? even + triangles : even;
}

}  // namespace

WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads,
                             double share) {
  WorkEstimate estimate;
  double processor = 0.0;
  const std::vector<Level> levels =
      plan_levels(working_size(columns, rows, options.pixels), options);
  for (const Level& level : levels) {
    const double per_cell = level.spline ? 2.0 * kMeshSamples * kMeshSamples : 2.0;
    const double triangles = per_cell * (level.grid.columns - 1.0) * (level.grid.rows - 1.0);
    const double pixels = level.pixels.cast<double>().prod();
    const double iterations = static_cast<double>(level.rounds) * level.iterations;
    double memory = kSplineMemory * triangles;
    const double whole = share < 1.0 ? kWholeMemory : 0.0;
    if (options.rendering_guided && !level.waves) {
      processor += triangles * iteration_seconds(level, options) *
                   usual_share(options, level.pixels) * iterations;
    }
    processor += lamp_seconds(level, &level == &levels.back(), triangles, options);
    if (level.waves) {
      const OpticalSetup setup = optical_setup(options, level.pixels);
      const double once = wave_seconds(setup, wave_options(options, setup).wavelength);
      processor += kWavesPerIteration * once * iterations + once;
      memory += kWaveMemory;
    }
    if (!level.spline) {
      const double sites = transport_sites(triangles, options);
      processor += kTransportSeconds * sites * options.transport_rounds;
      memory = std::max(kTransportMemory * std::min(sites, triangles),
                        (share * kMeshMemory + whole) * triangles);
    }
    estimate.memory_bytes = kBaseMemory + memory + kPixelMemory * pixels;
    estimate.disk_bytes = kTriangleDisk * triangles + kPixelDisk * pixels;
  }
  if (options.light.both_faces) processor *= kSharedFrontCost;
  if (options.second.picture) {
    const double pixels = levels.back().pixels.cast<double>().prod();
    processor = kTwoPicturesSeconds * pixels * options.iterations;
  }
  estimate.seconds = processor / threads;
  return estimate;
}

WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder,
                                     double share) {
  const auto work = [&](double pixels) {
    DesignOptions sized = options;
    sized.pixels = std::max(kMinPixels, static_cast<int>(pixels));
    return estimate_design(columns, rows, sized, threads, share);
  };
  return require_room_for(work, {"--pixels", 1.0 * options.pixels, kMinPixels}, folder);
}

}  // namespace lensforge
