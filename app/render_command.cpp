// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <optional>

#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/interruptible_job.h"
#include "app/json_output.h"
#include "app/lens_note.h"
#include "app/option_set.h"
#include "app/render_setup.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/surface/lens.h"
#include "core/surface/mesh_io.h"
#include "design/render_lens.h"
#include "export/export_work.h"
#include "export/solid_surface.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
  std::string source;
  std::string out;
  std::string target;
  bool force = false;
  int pixels = 256;
  double image_width = 100.0;
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;  ///< What the options for ior, focal length and view write to.
};

/// What is rendered and, if known, what it should look like.
struct Scene {
  SurfaceMesh surface;
  std::optional<Eigen::Matrix3Xd> normals;  ///< Of a solid's own surface, for the smooth model.
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kFacet;
  std::optional<Image> target;
};

/// Of walls and pictures on them, mm: beyond a kilometre nothing is projected any more.
constexpr Limits kLengths{.low = 1e-3, .high = 1e6};

void add_render_options(OptionSet& options, RenderArguments& arguments) {
  options.positional("SOURCE", arguments.source,
                     "lens folder; mesh: .ply, .obj, .stl, .off; "
                     "solid: .step, .stp");
  options.text("--out", arguments.out, "FILE", "write the picture to this .png or .exr");
  options.flag("--force", arguments.force, "replace a file that lensforge did not write");
  options.text("--target", arguments.target, "PICTURE", "compare with this; a lens has its own");
  options.choice("--model", arguments.model,
                 {{"facet", SurfaceModel::kFacet}, {"smooth", SurfaceModel::kSmooth}},
                 "surface model of the picture; a lens has its own default, a solid is smooth");
  options.integer("--pixels", arguments.pixels, Limits::between(1, kMaxImageSide),
                  "longer side of the picture; a lens has its own default");
  options.length("--focal", arguments.setup.focal_length, kLengths,
                 "z of the wall; a lens has its own default");
  options.number("--ior", arguments.setup.ior, {.low = 1.0, .high = 10.0, .low_excluded = true}, "",
                 "refractive index; a lens has its own default");
  options.choice("--view", arguments.setup.view,
                 {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
                 "side from which the picture is seen; a lens has its own default");
  options.length("--image-width", arguments.image_width, kLengths,
                 "width of the picture on the wall; a lens has its own default, a mesh its width");
}

bool is_step(const std::string& source) {
  std::string extension = fs::path(source).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".step" || extension == ".stp";
}

/// Points at which a solid is sampled, as export does for the picture that it prints.
constexpr double kSolidPoints = 4e6;

Scene load_solid(const std::string& source, const Executor& executor, const RunControl& control,
                 const Console& console) {
  SolidSurface solid = read_solid_surface(source, kSolidPoints, executor, control);
  console.note(
      std::to_string(solid.faces) + (solid.faces == 1 ? " face" : " faces") +
      (solid.by_name ? " named \"optical surface\"" : " found by their shape: they look up"));
  SampledSurface& samples = solid.samples;
  const OpticalSetup setup = setup_for_mesh(samples.mesh, RenderArguments{}.pixels);
  return {std::move(samples.mesh), std::move(samples.normals), setup, SurfaceModel::kSmooth, {}};
}

Scene load(const std::string& source, const Executor& executor, const RunControl& control,
           const Console& console) {
  if (is_step(source)) return load_solid(source, executor, control, console);
  if (is_folder(source)) {
    Lens lens = read_lens(source);
    note_unfinished_design(lens, console);
    return {std::move(lens.surface), {}, lens.setup, lens.model, std::move(lens.target)};
  }
  SurfaceMesh mesh = read_mesh(source);
  const OpticalSetup setup = setup_for_mesh(mesh, RenderArguments{}.pixels);
  return {std::move(mesh), {}, setup, RenderArguments{}.model, {}};
}

/// Tells what a large picture takes, or refuses it.
void announce_picture(const OpticalSetup& setup, const std::string& out, const Console& console) {
  const double shape = setup.pixels.cast<double>().prod() / std::pow(setup.pixels.maxCoeff(), 2);
  announce_work([&](double side) { return rendering_work(shape * side * side); }, "--pixels",
                setup.pixels.maxCoeff(), out.empty() ? "." : out, console);
}

/// The scene with everything that the options say instead.
Scene adjusted(Scene scene, const OptionSet& options, const RenderArguments& arguments,
               const Console& console) {
  OpticalSetup& setup = scene.setup;
  if (options.given("--model")) scene.model = arguments.model;
  if (options.given("--focal")) setup.focal_length = arguments.setup.focal_length;
  if (options.given("--ior")) setup.ior = arguments.setup.ior;
  if (options.given("--view")) setup.view = arguments.setup.view;
  if (options.given("--image-width")) setup = with_image_width(setup, arguments.image_width);
  if (options.given("--pixels")) setup = with_longer_side(setup, arguments.pixels);
  announce_picture(setup, arguments.out, console);
  if (options.given("--target")) scene.target = read_image(arguments.target).image;
  if (scene.target) scene.target = resample(*scene.target, setup.pixels.x(), setup.pixels.y());
  require_wall_above(scene.surface, setup);
  return scene;
}

/// Without a target there is no white to relate to: a PNG shows the brightest pixel as white.
Image scaled_to_white(Image image, const Console& console) {
  const float white = *std::max_element(image.values().begin(), image.values().end());
  if (!(white > 0.0F)) return image;
  console.note("no target: white is the brightest pixel, " + fixed(white, 2) + " times even light");
  for (float& value : image.values()) value /= white;
  return image;
}

/// What a command says at the end, and what it wrote.
struct Rendering {
  Image image;
  nlohmann::json json;
  std::string text;
};

bool has_normals_for(SurfaceModel model, const Scene& scene) {
  return model == SurfaceModel::kSmooth && scene.normals.has_value();
}

ImageMetrics judge(const Scene& scene, SurfaceModel model, Image* image, const Executor& executor) {
  if (has_normals_for(model, scene)) {
    return evaluate(scene.surface, *scene.normals, scene.setup, *scene.target, image, executor);
  }
  return evaluate(scene.surface, scene.setup, model, *scene.target, image, executor);
}

Rendering compare_models(const Scene& scene, const Executor& executor) {
  Rendering rendering;
  ModelMetrics metrics;
  for (const SurfaceModel model : kSurfaceModels) {
    Image* image = model == scene.model ? &rendering.image : nullptr;
    metrics[model] = judge(scene, model, image, executor);
  }
  rendering.json["metrics"] = metrics_json(metrics);
  rendering.text = metrics_text(metrics);
  return rendering;
}

Rendering render_alone(const Scene& scene, const Executor& executor) {
  const RenderResult result =
      has_normals_for(scene.model, scene)
          ? render_surface(scene.surface, *scene.normals, scene.setup, executor)
          : render_surface(scene.surface, scene.setup, scene.model, executor);
  return {result.image,
          {{"flux_inside", result.flux_inside}},
          "  " + model_name(scene.model) + "  flux inside " + fixed(100.0 * result.flux_inside, 1) +
              " %\n"};
}

void require_picture_name(const std::string& out) {
  const std::string extension = fs::path(out).extension().string();
  if (!out.empty() && extension != ".png" && extension != ".exr") {
    throw InputError("--out " + out + ": must end in .png or .exr");
  }
}

void write_picture(Rendering& rendering, const Scene& scene, const std::string& out,
                   InterruptibleJob& job, const Console& console) {
  const bool scale = !scene.target && fs::path(out).extension() == ".png";
  const Image image = scale ? scaled_to_white(rendering.image, console) : rendering.image;
  job.begin_writing();
  write_image(image, out, job.control());
  rendering.json["out"] = out;
}

}  // namespace

int render_command(const Arguments& command_line) try {
  RenderArguments arguments;
  OptionSet options("render", "Renders a lens or any mesh and compares it with its target.");
  add_render_options(options, arguments);
  options.parse(command_line);
  require_picture_name(arguments.out);
  if (!arguments.out.empty()) require_replaceable("--out", arguments.out, arguments.force);
  const Console console(options.common().json, options.common().quiet);
  InterruptibleJob job(options.common(), arguments.out);
  const Scene scene =
      adjusted(load(arguments.source, job.stoppable(options.executor()), job.control(), console),
               options, arguments, console);
  ChosenDevice device = options.device_executor();
  device.executor = job.stoppable(device.executor);
  job.control().report({"picture", 0.0, 0.0, ""});
  Rendering rendering =
      scene.target ? compare_models(scene, device.executor) : render_alone(scene, device.executor);
  if (!arguments.out.empty()) write_picture(rendering, scene, arguments.out, job, console);
  rendering.json["command"] = "render";
  rendering.json["device"] = device.word;
  rendering.json["source"] = arguments.source;
  rendering.json["model"] = model_name(scene.model);
  rendering.json["pixels"] = {scene.setup.pixels.x(), scene.setup.pixels.y()};
  console.result(rendering.json, arguments.source + "\n" + rendering.text);
  return kDone;
} catch (const Interrupted&) {
  const bool json =
      std::find(command_line.begin(), command_line.end(), "--json") != command_line.end();
  return report_interrupted(json);
}

}  // namespace lensforge::app
