// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "app/commands/settings.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "design/design.h"
#include "design/render.h"
#include "design/setup/design_options.h"
#include "design/waves/wave_picture.h"
#include "export/solid/solid_reading.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
  std::string source;
  std::string out;
  std::string target;
  Background background;  ///< Of the target.
  bool force = false;
  bool waves = false;
  double wavelength_nm = 550.0;
  double at = 0.0;  ///< z of another unturned screen, mm; 0: those of the scene.
  RenderOptions render;
};

/// The surface to render and, if known, its target.
struct Scene {
  SurfaceMesh surface;
  std::optional<Eigen::Matrix3Xd> normals;  ///< Of a solid's own surface, for the smooth model.
  std::optional<SampledSurface> spline;     ///< A lens's own, for the spline model.
  std::optional<ControlNet> net;            ///< Likewise.
  RenderOptions render;
  std::optional<Image> target;
  std::optional<SecondPicture> second = {};  ///< Of a lens for two pictures.
};

void describe(Description& d, RenderArguments& arguments) {
  d.text("SOURCE", arguments.source, "",
         "lens folder; mesh: .ply, .obj, .stl, .off; "
         "solid: .step, .stp")
      .needed = true;
  d.text("--out", arguments.out, "FILE", "write the picture to this .png or .exr");
  d.flag("--force", arguments.force, "replace a file that lensforge did not write");
  d.text("--target", arguments.target, "PICTURE", "compare with this; a lens has its own");
  describe(d, arguments.background);
  d.flag("--waves", arguments.waves,
         "the picture as a wave makes it, beside that of rays: diffraction softens what is finer "
         "than √(λ f); takes seconds");
  d.number("--wavelength", arguments.wavelength_nm, Limits::between(kMinWavelength, kMaxWavelength),
           "nm", "of the wave; white light is as 550");
  describe_at(d, arguments.at);
  describe(d, arguments.render);
}

Scene load_solid(const std::string& source, CommandFrame& frame) {
  SolidSurface solid = read_solid_surface(source, kPictureNodes, frame.executor(), frame.control());
  frame.console().note(std::to_string(solid.faces) + (solid.faces == 1 ? " face" : " faces") +
                       (solid.by_name ? " named \"optical surface\""
                                      : " found by shape: the faces that point towards +z"));
  SampledSurface& samples = solid.samples;
  const RenderOptions render{SurfaceModel::kSmooth, setup_for_mesh(samples.mesh)};
  return {std::move(samples.mesh), std::move(samples.normals), {}, {}, render, {}};
}

Scene load(const std::string& source, CommandFrame& frame) {
  if (is_step_file(source)) return load_solid(source, frame);
  if (is_folder(source)) {
    Lens lens = read_lens(source);
    note_unfinished_design(lens, frame.console());
    Scene scene{std::move(lens.surface), {}, {}, {}, {lens.model, lens.setup},
                std::move(lens.target)};
    if (lens.spline) scene.spline = picture_nodes(*lens.spline);
    scene.net = std::move(lens.spline);
    scene.second = std::move(lens.second);
    return scene;
  }
  SurfaceMesh mesh = read_mesh(source);
  const RenderOptions render{RenderOptions{}.model, setup_for_mesh(mesh)};
  return {std::move(mesh), {}, {}, {}, render, {}};
}

/// Returns the cost of a picture. @throw InputError if there is no room for it.
WorkEstimate require_room_for_picture(const OpticalSetup& setup, const std::string& out) {
  const double shape = setup.pixels.cast<double>().prod() / std::pow(setup.pixels.maxCoeff(), 2);
  const auto work = [&](double side) { return rendering_work(shape * side * side); };
  const fs::path folder = fs::absolute(out.empty() ? "." : out).parent_path();
  return require_room_for(work, {"--pixels", 1.0 * setup.pixels.maxCoeff()}, folder);
}

/// @throw InputError if the colour options do not fit the others.
void require_spectrum(const Scene& scene, const OptionSet& options,
                      const RenderArguments& arguments) {
  const OpticalSetup& setup = scene.render.setup;
  if (setup.spectrum.none() && options.given("--abbe")) {
    throw InputError("--abbe: needs --wavelengths; --wavelengths 450,550,650 works");
  }
  if (setup.spectrum.none()) return;
  if (!traits(setup.body).transmits) {
    throw InputError(std::string("--wavelengths: a ") + traits(setup.body).name +
                     " bends light of all colours alike; leave it out");
  }
  if (fs::path(arguments.out).extension() == ".exr") {
    throw InputError("--out " + arguments.out +
                     ": must end in .png, since the picture is in colour");
  }
}

/// @throw InputError if the options do not fit a picture by waves.
void require_waves(const Scene& scene, const OptionSet& options, const RenderArguments& arguments) {
  if (!arguments.waves) {
    if (!options.given("--wavelength")) return;
    throw InputError("--wavelength: needs --waves");
  }
  if (scene.render.model == SurfaceModel::kFacet) {
    throw InputError(
        "--waves: facets have creases, which a wave does not show as rays do; use "
        "--model smooth or a lens that was designed as a spline");
  }
  if (!scene.render.setup.spectrum.none()) {
    throw InputError("--waves: is a picture of one wavelength; leave out --wavelengths");
  }
  if (scene.normals) {
    throw InputError("--waves: needs a lens or a mesh; " + arguments.source + " is a solid");
  }
}

void put_lamp(const RenderArguments& arguments, CommandFrame& frame, RenderOptions& render) {
  LightOptions& light = render.light;
  if (light.lamp.empty()) return;
  read_lamp(light, arguments.background, frame.control(), frame.console());
  put_lamp(light, render.setup);
}

/// The setup with its picture moved along the light to another z. Between two screens its size and
/// centre change evenly from the first to the second. The screen is not turned.
/// @param height  of the surface, about, mm.
OpticalSetup at_distance(OpticalSetup setup, double z, double height) {
  setup.screen_x = Eigen::Vector3d::UnitX();
  setup.screen_y = Eigen::Vector3d::UnitY();
  if (!setup.second) return at_focal_length(setup, z, height);
  const OpticalSetup far = on_second_screen(setup);
  const double share = (z - setup.focal_length) / (far.focal_length - setup.focal_length);
  setup.image_origin += share * (far.image_origin - setup.image_origin);
  setup.image_size += share * (far.image_size - setup.image_size);
  setup.focal_length = z;
  setup.second.reset();
  return setup;
}

/// Takes --at. @throw InputError if it does not fit the other options or the lens.
void put_distance(const OptionSet& options, double z, Scene& scene) {
  if (z == 0.0) return;
  if (options.given("--target")) {
    throw InputError("--at: cannot be given with --target; leave one out");
  }
  const double height = scene.surface.vertices.row(2).mean();
  scene.render.setup = setup_at(options, z, height, scene.render.setup);
  scene.target.reset();
  scene.second.reset();
}

/// The scene with everything that the options say instead.
Scene adjusted(Scene scene, CommandFrame& frame, RenderArguments& arguments) {
  OptionSet& options = frame.options();
  arguments.render = scene.render;
  options.restate();
  scene.render = arguments.render;
  put_lamp(arguments, frame, scene.render);
  put_distance(options, arguments.at, scene);
  if (scene.render.model == SurfaceModel::kSpline && !scene.spline) {
    throw InputError("--model spline: must be facet or smooth, since " + arguments.source +
                     " is no lens that was designed as a spline");
  }
  const OpticalSetup& setup = scene.render.setup;
  require_spectrum(scene, options, arguments);
  require_waves(scene, options, arguments);
  const WorkEstimate work = require_room_for_picture(setup, arguments.out);
  if (options.given("--target")) {
    LoadedImage target = read_image(arguments.target, frame.control(), setup.pixels.maxCoeff(),
                                    arguments.background);
    for (const std::string& change : target.changes) {
      frame.console().note("--target " + arguments.target + ": " + change);
    }
    scene.target = std::move(target.image);
  } else if (options.given("--background")) {
    throw InputError("--background: is for the picture of --target, which is not given");
  }
  if (scene.target) scene.target = resample(*scene.target, setup.pixels.x(), setup.pixels.y());
  require_wall_above(scene.surface, setup, arguments.at > 0.0 ? "--at" : "--focal");
  announce_work(work, frame.console());
  return scene;
}

/// Without a target there is no white to relate to: a PNG shows the brightest pixel as white.
/// @return the brightest pixel, or 0 where nothing was scaled.
float scale_to_white(Image& image) {
  const float white = *std::max_element(image.values().begin(), image.values().end());
  if (!(white > 0.0F)) return 0.0F;
  for (float& value : image.values()) value /= white;
  return white;
}

/// Result of the command, and its files.
struct Rendering {
  Image image;
  std::optional<ColorImage> color;  ///< Instead of it.
  nlohmann::json json;
  std::string text;
};

bool has_normals_for(SurfaceModel model, const Scene& scene) {
  return model == SurfaceModel::kSmooth && scene.normals.has_value();
}

std::vector<SurfaceModel> models_of(const Scene& scene) {
  std::vector<SurfaceModel> models(kMeshModels.begin(), kMeshModels.end());
  if (scene.spline) models.push_back(SurfaceModel::kSpline);
  return models;
}

ImageMetrics judge(const Scene& scene, SurfaceModel model, Image* image, const Executor& executor) {
  if (model == SurfaceModel::kSpline) {
    return evaluate(scene.spline->mesh, scene.spline->normals, scene.render.setup, *scene.target,
                    image, executor);
  }
  if (has_normals_for(model, scene)) {
    return evaluate(scene.surface, *scene.normals, scene.render.setup, *scene.target, image,
                    executor);
  }
  return evaluate(scene.surface, scene.render.setup, model, *scene.target, image, executor);
}

Rendering compare_models(const Scene& scene, const Executor& executor) {
  Rendering rendering;
  ModelMetrics metrics;
  for (const SurfaceModel model : models_of(scene)) {
    Image* image = model == scene.render.model ? &rendering.image : nullptr;
    metrics[model] = judge(scene, model, image, executor);
  }
  rendering.json["metrics"] = metrics_json(metrics);
  rendering.text = metrics_text(metrics);
  return rendering;
}

RenderResult project(const Scene& scene, const Executor& executor) {
  const RenderOptions& render = scene.render;
  if (render.model == SurfaceModel::kSpline) {
    return render_surface(scene.spline->mesh, scene.spline->normals, render.setup, executor);
  }
  return has_normals_for(render.model, scene)
             ? render_surface(scene.surface, *scene.normals, render.setup, executor)
             : render_surface(scene.surface, render.setup, render.model, executor);
}

Rendering render_alone(const Scene& scene, const Executor& executor) {
  const RenderResult result = project(scene, executor);
  return {result.image,
          {},
          {{"flux_inside", result.flux_inside}},
          "  " + model_name(scene.render.model) + "  flux inside " +
              fixed(100.0 * result.flux_inside, 1) + " %\n"};
}

/// Fringe of the surface under its model, with vertex_area_normals().
Fringe fringe_of(const Scene& scene) {
  const OpticalSetup& setup = scene.render.setup;
  if (scene.render.model == SurfaceModel::kSpline) {
    return fringe_of(scene.spline->mesh, scene.spline->normals, setup);
  }
  const Eigen::Matrix3Xd normals =
      scene.normals ? *scene.normals : vertex_area_normals(scene.surface);
  return fringe_of(scene.surface, normals, setup);
}

/// The picture of each wavelength, relative to the target's white, or to even light without one.
std::vector<Image> pictures_of(const Scene& scene, const Executor& executor) {
  const Eigen::Vector2i& pixels = scene.render.setup.pixels;
  const double even = scene.target ? scene.target->total() / pixels.prod() : 1.0;
  std::vector<Image> pictures;
  for (const LightColor& color : light_colors(scene.render.setup)) {
    Scene colored = scene;
    colored.render.setup = color.setup;
    pictures.push_back(project(colored, executor).image);
    for (float& value : pictures.back().values()) value *= static_cast<float>(even);
  }
  return pictures;
}

Rendering render_spectrum(const Scene& scene, const Executor& executor) {
  const Spectrum& spectrum = scene.render.setup.spectrum;
  const std::vector<Image> pictures = pictures_of(scene, executor);
  const Fringe fringe = fringe_of(scene);
  Rendering rendering;
  rendering.color = color_picture(pictures, spectrum.wavelengths, spectrum.powers);
  rendering.json = {{"wavelengths_nm", spectrum.wavelengths},
                    {"fringe_mm", {{"mean", fringe.mean}, {"max", fringe.max}}}};
  rendering.text = fringe_text(fringe);
  if (!scene.target) return rendering;
  const Image seen = mixed(pictures, spectrum.shares());
  ImageMetrics metrics = compare(seen, *scene.target);
  metrics.flux_inside = seen.total() / scene.target->total();
  rendering.json["metrics"] = {{model_name(scene.render.model), metrics_json(metrics)}};
  rendering.text += "  " + model_name(scene.render.model) + "  " + metrics_text(metrics) + "\n";
  return rendering;
}

/// Adds the picture by waves; it takes the place of that by rays.
void add_waves(const Scene& scene, double wavelength_nm, CommandFrame& frame,
               Rendering& rendering) {
  const OpticalSetup& setup = scene.render.setup;
  const SurfaceModel model = scene.render.model;
  const std::shared_ptr<const OpticalSurface> surface =
      model == SurfaceModel::kSpline ? std::make_shared<const SplineSurface>(*scene.net)
                                     : optical_surface(scene.surface, model);
  WaveOptions options;
  options.wavelength = kMmPerNm * wavelength_nm;
  const OpticalField field(*surface);
  const SurfaceField* const one = &field;
  const std::vector<double> flux = wave_flux(setup, wave_grid(setup, *surface), {&one, 1}, options,
                                             frame.executor(), frame.control())
                                       .front();
  rendering.image = Image(setup.pixels.x(), setup.pixels.y());
  const double total = scene.target ? scene.target->total() : setup.pixels.prod();
  double inside = 0.0;
  for (std::size_t i = 0; i < flux.size(); ++i) {
    rendering.image.values()[i] = static_cast<float>(total * flux[i]);
    inside += flux[i];
  }
  nlohmann::json waves{{"wavelength_nm", wavelength_nm}, {"flux_inside", inside}};
  rendering.text += "  by waves of " + trimmed_decimal(wavelength_nm, 1) + " nm  ";
  if (scene.target) {
    ImageMetrics metrics = compare(rendering.image, *scene.target);
    metrics.flux_inside = inside;
    waves.update(metrics_json(metrics));
    rendering.text += metrics_text(metrics) + "\n";
  } else {
    rendering.text += "flux inside " + fixed(100.0 * inside, 1) + " %\n";
  }
  rendering.json["waves"] = waves;
}

Rendering rendered(const Scene& scene, const Executor& executor) {
  if (!scene.render.setup.spectrum.none()) return render_spectrum(scene, executor);
  return scene.target ? compare_models(scene, executor) : render_alone(scene, executor);
}

/// True if the scene has a second screen, and a surface that its picture is rendered of.
bool shows_second(const Scene& scene) {
  return scene.second && scene.spline && scene.render.model == SurfaceModel::kSpline;
}

/// The file of the picture on the second screen, named after the first's.
fs::path second_file(const fs::path& out) {
  return out.parent_path() / (out.stem().string() + "_second" + out.extension().string());
}

/// Adds the picture on a lens's second screen.
void add_second(const Scene& scene, const std::string& out, const Executor& executor,
                CommandFrame& frame, Rendering& rendering) {
  if (!shows_second(scene)) return;
  const OpticalSetup setup = on_second_screen(scene.render.setup);
  const Image target = resample(scene.second->target, setup.pixels.x(), setup.pixels.y());
  Image picture;
  const ImageMetrics metrics =
      evaluate(scene.spline->mesh, scene.spline->normals, setup, target, &picture, executor);
  rendering.json["second"] = {{"metrics", metrics_json(metrics)}};
  rendering.text += "  second  " + metrics_text(metrics) + "\n";
  if (out.empty()) return;
  write_image(picture, second_file(out), frame.control());
  rendering.json["second"]["out"] = second_file(out).string();
}

void require_picture_name(const std::string& out) {
  const std::string extension = fs::path(out).extension().string();
  if (!out.empty() && extension != ".png" && extension != ".exr") {
    throw InputError("--out " + out + ": must end in .png or .exr");
  }
}

void write_picture(Rendering& rendering, const Scene& scene, const std::string& out,
                   CommandFrame& frame) {
  const bool scale = !rendering.color && !scene.target && fs::path(out).extension() == ".png";
  Image image = rendering.image;
  const float white = scale ? scale_to_white(image) : 0.0F;
  frame.begin_writing();
  if (rendering.color) {
    write_image(*rendering.color, out);
  } else {
    write_image(image, out, frame.control());
  }
  if (white > 0.0F) {
    frame.console().note("no target: white is the brightest pixel, " + fixed(white, 2) +
                         " times even light");
  }
  rendering.json["out"] = out;
}

CommandResult run(CommandFrame& frame, RenderArguments& arguments) {
  require_picture_name(arguments.out);
  if (!arguments.out.empty()) require_replaceable("--out", arguments.out, arguments.force);
  frame.begin_file(arguments.out);
  const Scene scene = adjusted(load(arguments.source, frame), frame, arguments);
  if (!arguments.out.empty() && shows_second(scene)) {
    require_replaceable("--out", second_file(arguments.out), arguments.force);
  }
  const ChosenDevice device = frame.device_executor();
  frame.control().report({"picture", 0.0, 0.0, ""});
  Rendering rendering = rendered(scene, device.executor);
  if (arguments.waves) add_waves(scene, arguments.wavelength_nm, frame, rendering);
  if (!arguments.out.empty()) write_picture(rendering, scene, arguments.out, frame);
  add_second(scene, arguments.out, device.executor, frame, rendering);
  rendering.json["device"] = device.word;
  rendering.json["source"] = arguments.source;
  rendering.json["model"] = model_name(scene.render.model);
  rendering.json["pixels"] = {scene.render.setup.pixels.x(), scene.render.setup.pixels.y()};
  return {rendering.json, arguments.source + "\n" + rendering.text};
}

}  // namespace

void describe_at(Description& d, double& z) {
  d.length("--at", z, Limits::zero_or(kMinThickness, kMaxFocalLength),
           "the light at this z instead, without a target: between a lens's two screens its size "
           "and place lie between theirs");
}

OpticalSetup setup_at(const OptionSet& options, double z, double height,
                      const OpticalSetup& setup) {
  if (options.given("--focal")) {
    throw InputError("--at: cannot be given with --focal; leave one out");
  }
  OpticalSetup there = at_distance(setup, z, height);
  if (there.image_size.minCoeff() > 0.0) return there;
  throw InputError("--at " + number_text(z) +
                   ": there the picture has no size left between those of the two screens; a z "
                   "between them works");
}

int render_command(const Arguments& arguments) {
  return run_command<RenderArguments>(
      {"render", "Renders a lens, mesh or STEP solid and compares it with its target.", run},
      arguments);
}

}  // namespace lensforge::app
