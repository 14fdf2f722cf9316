// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/export.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/description.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/render.h"
#include "design/render/source_picture.h"
#include "export/files/closed_solid.h"
#include "export/files/mesh_formats.h"
#include "export/solid/solid_files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStep = "step";
constexpr const char* kIges = "iges";
constexpr const char* kExr = "exr";
constexpr const char* kPng = "png";

Choices<ExportFormat> formats() {
  Choices<ExportFormat> words;
  const auto add = [&words](const char* word) { words.emplace_back(word, word); };
  for (const char* word : {kByExtension, kStep, kIges}) add(word);
  for (const MeshFormat& format : mesh_formats()) add(format.word);
  for (const char* word : {kExr, kPng}) add(word);
  return words;
}

/// It is one field of the file's header.
void require_author(const std::string& author) {
  constexpr std::size_t kMaxBytes = 200;
  if (author.size() > kMaxBytes) {
    throw InputError("--author: has " + std::to_string(author.size()) + " bytes; at most " +
                     std::to_string(kMaxBytes) + " are possible");
  }
  // OpenCASCADE writes other bytes as they are, which neither format allows.
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (!std::all_of(author.begin(), author.end(), is_printable)) {
    throw InputError("--author: holds a character that is not printable ASCII; write it without");
  }
}

}  // namespace

void describe(Description& d, ExportOptions& o) {
  d.flag("--force", o.force, "replace a file that lensforge did not write");
  std::vector<std::string> meshes;
  for (const MeshFormat& format : mesh_formats()) {
    meshes.push_back(joined({format.word, *format.note == '\0' ? "" : " ", format.note}));
  }
  d.word("--format", o.format, formats(),
         "solid as step or iges; closed mesh as " + joined(meshes, ", ") +
             "; height map as exr (32-bit, mm) or png (16-bit grey)");
  d.whole("--pixels", o.pixels, Limits::between(2, kMaxImageSide), "longer side of a height map");
  d.length("--tolerance", o.tolerance, Limits::between(1e-6, 1.0),
           "step, iges: largest distance of the splines from the smooth surface");
  d.number("--normal-tolerance", o.normal_tolerance, Limits::between(1e-6, 0.1), "rad",
           "step, iges: largest angle to the normals of the vertex-normal model");
  d.whole("--max-points", o.max_points, Limits::between(0, 1e7),
          "step, iges: maximum number of control points, about 72 bytes each; 0: four a vertex, "
          "575000 at most");
  d.word("--schema", o.schema, {{"ap214", StepSchema::kAp214}, {"ap242", StepSchema::kAp242}},
         "step: application protocol");
  d.text("--author", o.author, "NAME", "step, iges: author in the header; printable ASCII");
}

bool is_height_map(const ExportFormat& format) { return format == kExr || format == kPng; }

bool is_spline_solid(const ExportFormat& format) { return format == kStep || format == kIges; }

ExportFormat export_format(const ExportOptions& options, const fs::path& out) {
  if (options.format != kByExtension) return options.format;
  const std::string extension = lower_case(out.extension().string());
  if (extension == ".stp") return kStep;
  if (extension == ".igs") return kIges;
  std::string known;
  for (const auto& [word, meaning] : formats()) {
    if (meaning == kByExtension) continue;
    const std::string ending = joined({".", word});
    if (extension == ending) return meaning;
    known = with_word(std::move(known), ending);
  }
  throw InputError("--out " + out.string() + ": must end in one of " + known +
                   ", or --format must say what to write");
}

void validate(const ExportOptions& options, const fs::path& out) {
  require_limits(options);
  require_author(options.author);
  export_format(options, out);
  if (is_folder(out)) throw InputError("--out " + out.string() + ": is a folder, not a file");
  require_replaceable("--out", out, options.force);
}

namespace {

// The costs below were measured on two cores at 2.6 GHz, with a lens of 96 x 71 pixels.

/// The program itself, the lens and its pictures.
constexpr double kProgramBytes = 1.5e8;

/// 8192 x 5982 pixels take 27 s as EXR and 30 s as PNG; the files have 3.1 and 0.3 bytes per pixel,
/// at most 4 and 2.
constexpr double kSecondsPerPixel = 6e-7;

/// 500,000 control points take 51 s and 0.68 GB, 1,073,000 take 163 s and 1.25 GB.
constexpr double kSecondsPerPoint = 1.4e-4;
constexpr double kFastPoints = 1e6;
constexpr double kMemoryPerPoint = 1100.0;
constexpr double kFilePerPoint = 72.0;

}  // namespace

WorkEstimate height_map_work(double pixels, bool grey) {
  const double file = grey ? 2.0 : 4.0;
  const double images = grey ? 8.0 : 4.0;
  // The file's bytes are in memory, twice while the buffer grows.
  return {.seconds = kSecondsPerPixel * pixels,
          .disk_bytes = file * pixels,
          .memory_bytes = kProgramBytes + (images + 2.0 * file) * pixels};
}

WorkEstimate spline_solid_work(double control_points) {
  return {.seconds = kSecondsPerPoint * control_points * std::sqrt(control_points / kFastPoints),
          .disk_bytes = kFilePerPoint * control_points,
          .memory_bytes = kProgramBytes + kMemoryPerPoint * control_points};
}

namespace {

/// An export with all that it works with.
struct Job {
  const ExportSource& source;
  const fs::path& out;
  const ExportOptions& options;
  ExportFormat format;
  const Executor& executor;
  const RunControl& control;
  const ExportHooks& hooks;

  void announce(const WorkEstimate& work) const {
    if (hooks.announce) hooks.announce(work);
  }
  void begin_writing() const {
    if (hooks.begin_writing) hooks.begin_writing();
  }
  [[nodiscard]] fs::path folder() const { return fs::absolute(out).parent_path(); }
};

StepHeader header_of(const Job& job) {
  return {.name = "lensforge lens",
          .description = "optical surface sha256:" + sha256_of(job.source.file),
          .author = job.options.author,
          .program = program_mark(),
          .time_stamp = file_time(job.source.file)};
}

/// Points at which the splines are sampled for their picture, at least; with six a cell of the mesh
/// each way the MAE no longer falls by more than 0.0001.
constexpr double kPicturePoints = 1e6;
constexpr double kPictureDensity = 6.0;
constexpr double kMaxPicturePoints = 4e6;

ImageMetrics picture_of(const SplineNet& net, const Lens& lens, const Executor& executor) {
  const Eigen::Vector2d size(net.u.back() - net.u.front(), net.v.back() - net.v.front());
  const double cells = 0.5 * static_cast<double>(lens.surface.triangle_count());
  const double points =
      std::clamp(kPictureDensity * kPictureDensity * cells, kPicturePoints, kMaxPicturePoints);
  const Eigen::Vector2d count = size / std::sqrt(size.prod() / points);
  const SampledSurface solid =
      sampled(net, {static_cast<int>(count.x()) + 2, static_cast<int>(count.y()) + 2});
  return evaluate(solid.mesh, solid.normals, lens.setup, lens.target, nullptr, executor);
}

PictureGoal goal_of(const WantedPicture& wanted, const OpticalSetup& setup) {
  PictureGoal goal;
  goal.reach = wanted.reach();
  goal.miss = [&wanted](const SampledSurface& solid) {
    WantedPicture::Comparison found = wanted.compare(solid.mesh, solid.normals);
    return PictureMiss{found.excess, std::move(found.missing)};
  };
  if (LightPath(setup).varies()) {
    goal.stretch = [&wanted](const Eigen::Vector3d& p, const Eigen::Vector2d& slope,
                             const Eigen::Matrix2d& bend) {
      return wanted.stretch(p, slope, bend);
    };
  }
  return goal;
}

/// @param control_points  of the surface; those of a front that is a height map come on top.
void announce_splines(const Job& job, std::int64_t control_points) {
  auto points = static_cast<double>(control_points);
  const std::optional<Front>& front = job.source.lens.setup.front;
  if (const auto* const map = front ? std::get_if<HeightFront>(&*front) : nullptr) {
    points += static_cast<double>(map->spline->coefficients().size());
  }
  job.announce(require_room_for(&spline_solid_work, {"--max-points", points}, job.folder()));
}

/// Fits splines to a mesh; they project its picture.
SplineSolid fitted_splines(const Job& job) {
  const Lens& lens = job.source.lens;
  FitOptions options{.tolerance = job.options.tolerance,
                     .normal_tolerance = job.options.normal_tolerance,
                     .max_control_points = job.options.max_points,
                     .one_patch = lens.setup.outline.has_value(),
                     .picture = {}};
  SplineSolid solid;
  const SmoothSurface surface(lens.surface);
  announce_splines(job, most_control_points(surface, options));
  job.control.report({"spline knots", 0.0, 0.0, ""});
  const WantedPicture wanted(lens.surface, lens.setup, lens.target, job.executor);
  solid.fit = SplineFit{options, {}};
  options.picture = goal_of(wanted, lens.setup);
  solid.net = fit_spline_net(surface, options, job.executor, job.control);
  job.control.report({"spline normals", 0.0, 0.0, ""});
  solid.fit->bound = normal_bound(surface, options.normal_tolerance);
  job.control.report({"picture of the solid", 0.0, 0.0, ""});
  solid.picture = picture_of(solid.net, lens, job.executor);
  return solid;
}

/// The spline of a lens that is one.
SplineSolid own_spline(const Job& job) {
  const Lens& lens = job.source.lens;
  announce_splines(job, control_points_of_net(*lens.spline));
  SplineSolid solid;
  solid.net = lens.setup.outline ? patch_of(*lens.spline, job.executor)
                                 : net_of(*lens.spline, job.executor);
  job.control.report({"picture of the solid", 0.0, 0.0, ""});
  solid.picture = evaluate(lens, SurfaceModel::kSpline, nullptr, job.executor);
  return solid;
}

/// The solid's optical face as a mesh with the normals that determine its picture.
SampledSurface part_of(const Job& job) { return lens_part(job.source.lens, job.executor); }

SplineSolid write_splines(const Job& job) {
  const Lens& lens = job.source.lens;
  const std::string name = job.source.file.string();
  if (lens.setup.outline && lens.setup.front &&
      std::holds_alternative<HeightFront>(*lens.setup.front)) {
    throw InputError(name +
                     ": a solid of splines has either an outline or a height map for a front, not "
                     "both; export a mesh instead, as --out lens.stl");
  }
  require_rectangle(lens.surface, height_field_outline(lens.surface, name), name);
  job.control.report({"closed mesh", 0.0, 0.0, ""});
  const double mesh_volume =
      enclosed_volume(closed_solid(part_of(job).mesh, name, lens.setup.front));
  SplineSolid solid = lens.spline ? own_spline(job) : fitted_splines(job);
  solid.net.front = lens.setup.front;
  solid.net.outline = lens.setup.outline;
  solid.mesh_volume = mesh_volume;
  const StepHeader header = header_of(job);
  job.begin_writing();
  solid.content = job.format == kIges
                      ? write_iges(solid.net, header, job.out, job.control)
                      : write_step(solid.net, header, job.options.schema, job.out, job.control);
  return solid;
}

MeshSolid write_mesh(const Job& job) {
  job.control.report({"closed mesh", 0.0, 0.0, ""});
  const Lens& lens = job.source.lens;
  SampledSurface surface = part_of(job);
  const std::int64_t triangles = surface.mesh.triangle_count();
  const ClosedMesh mesh{
      .solid = closed_solid(surface.mesh, job.source.file.string(), lens.setup.front),
      .normals = std::move(surface.normals),
      .surface_triangles = triangles,
      .curved_back = lens.setup.front ? triangles : 0,
      .ior = lens.setup.ior,
      .mirror = !traits(lens.setup.body).transmits};
  const std::string title = program_mark() + " lens, millimetres";
  job.begin_writing();
  for (const MeshFormat& format : mesh_formats()) {
    if (job.format == format.word) format.write(mesh, title, job.out);
  }
  return {static_cast<std::int64_t>(mesh.solid.triangle_count()), enclosed_volume(mesh.solid)};
}

/// Reports the cost of a height map. @throw InputError if there is no room for it.
void announce_heights(const Job& job) {
  const auto work = [&](double side) {
    const GridShape shape =
        height_map_shape(job.source.lens.setup.lens_size, static_cast<int>(side));
    return height_map_work(double{1} * shape.columns * shape.rows, job.format == kPng);
  };
  job.announce(require_room_for(work, {"--pixels", 1.0 * job.options.pixels}, job.folder()));
}

HeightMap write_heights(const Job& job) {
  const Lens& lens = job.source.lens;
  const auto surface =
      optical_surface(lens, lens.spline ? SurfaceModel::kSpline : SurfaceModel::kSmooth);
  const Image heights = height_map(*surface, job.options.pixels, job.executor, job.control);
  HeightMap map{
      {heights.columns(), heights.rows()}, surface->box().sizes().x() / heights.columns(), {}};
  job.begin_writing();
  if (job.format == kExr) {
    write_image(heights, job.out, job.control);
  } else {
    map.scale = write_grey_relief(heights, job.out, job.executor, job.control);
  }
  return map;
}

}  // namespace

ExportSource read_export_source(const fs::path& folder, ExportSurface surface) {
  ExportSource source{read_lens(folder), folder / lens_file::kSurface};
  if (surface == ExportSurface::kMilled) {
    source.file = folder / lens_file::kCut / "milled.ply";
    source.lens.surface = read_mesh(source.file);
    source.lens.spline.reset();
    source.lens.model = SurfaceModel::kSmooth;
  }
  height_field_outline(source.lens.surface, source.file.string());
  return source;
}

ExportResult export_lens(const ExportSource& source, const fs::path& out,
                         const ExportOptions& options, const Executor& executor,
                         const RunControl& control, const ExportHooks& hooks) {
  validate(options, out);
  const Job job{source, out, options, export_format(options, out), executor, control, hooks};
  if (is_height_map(job.format)) announce_heights(job);
  const Lens& lens = source.lens;
  ExportResult result;
  result.format = job.format;
  for (const SurfaceModel model : models_of(lens)) {
    result.metrics[model] = evaluate(lens, model, nullptr, executor);
  }
  if (is_spline_solid(job.format)) {
    result.splines = write_splines(job);
  } else if (is_height_map(job.format)) {
    result.heights = write_heights(job);
  } else {
    result.mesh = write_mesh(job);
  }
  return result;
}

GridShape height_map_shape(const Eigen::Vector2d& size, int longer_side) {
  const double pixel = size.maxCoeff() / longer_side;
  return {std::max(1, static_cast<int>(std::lround(size.x() / pixel))),
          std::max(1, static_cast<int>(std::lround(size.y() / pixel)))};
}

Image height_map(const OpticalSurface& surface, int longer_side, const Executor& executor,
                 const RunControl& control) {
  const Eigen::Vector2d size = surface.box().sizes();
  const GridShape shape = height_map_shape(size, longer_side);
  const int columns = shape.columns;
  const int rows = shape.rows;
  Image image(columns, rows);
  const auto set_height = [&](std::int64_t i) {
    const std::int64_t column = i % columns;
    const std::int64_t row = i / columns;
    const Eigen::Array2d share((static_cast<double>(column) + 0.5) / columns,
                               1.0 - (static_cast<double>(row) + 0.5) / rows);
    const auto point = surface.at(surface.box().min() + (share * size.array()).matrix());
    if (point) image.values()[static_cast<std::size_t>(i)] = static_cast<float>(point->z);
  };
  constexpr std::int64_t kPixelsAtOnce = 1 << 20;  // A look for a stop request every 0.2 s or so.
  const std::int64_t count = std::int64_t{columns} * rows;
  for (std::int64_t first = 0; first < count; first += kPixelsAtOnce) {
    if (control.stop_requested()) throw Interrupted();
    const auto share = static_cast<double>(first);
    control.report({"height map", share, static_cast<double>(count), ""});
    parallel_for(executor, "height map", std::min(kPixelsAtOnce, count - first),
                 [&](std::int64_t i) { set_height(first + i); });
  }
  return image;
}

GreyScale write_grey_relief(const Image& heights, const std::filesystem::path& path,
                            const Executor& executor, const RunControl& control) {
  const auto [low, high] = std::minmax_element(heights.values().begin(), heights.values().end());
  const double black = *low;
  const double range = std::max(double{*high} - *low, 1e-12);
  Image relief(heights.columns(), heights.rows());
  // write_image() stores the encoded value: decoded beforehand, the file's numbers are linear.
  parallel_for(executor.with_stop(control.stop_token()), "grey relief",
               static_cast<std::int64_t>(relief.values().size()), [&](std::int64_t at) {
                 const auto i = static_cast<std::size_t>(at);
                 relief.values()[i] =
                     static_cast<float>(decode((heights.values()[i] - black) / range));
               });
  write_image(relief, path, control);
  return {*low, *high};
}

}  // namespace lensforge
