// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>

#include "app/commands.h"
#include "app/console.h"
#include "app/earlier_design.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/json_output.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/overview.h"
#include "app/progress_display.h"
#include "core/error.h"
#include "core/files.h"
#include "core/image_io.h"
#include "design/design_lens.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

struct DesignArguments {
  std::string target;
  std::string out;
  DesignOptions design;
  double smoothness = 1.0;
  bool resume = false;
  bool force = false;
};

void add_lens_options(OptionSet& options, DesignOptions& design) {
  options.length("--width", design.width, Limits::above(0),
                 "lens width; the height follows the picture");
  options.length("--focal", design.focal_length, Limits::above(0),
                 "distance from the flat face to the wall");
  options.number("--ior", design.ior, Limits::above(1), "", "refractive index of the lens");
  options.length("--thickness", design.thickness, Limits::above(0), "least thickness of the lens");
  options.choice("--model", design.model,
                 {{"facet", SurfaceModel::kFacet}, {"smooth", SurfaceModel::kSmooth}},
                 "what bends the light: flat facets, or a surface smooth at every vertex");
  options.choice("--view", design.view, {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
                 "picture seen on a wall from the lens's side, or on a screen from behind");
}

void add_effort_options(OptionSet& options, DesignOptions& design) {
  options.integer("--pixels", design.pixels, Limits::at_least(2),
                  "longer side of the working picture, never more than the picture has");
  options.number("--mesh-ratio", design.mesh_ratio, Limits::between(0.25, 8), "",
                 "mesh vertices per pixel side");
  options.integer("--rounds", design.rounds, Limits::between(1, 1000), "rounds at each resolution");
  options.choice("--quality", design.iterations, {{"draft", 20}, {"standard", 60}, {"paper", 200}},
                 "most iterations of one round: 20, 60 or 200");
}

void add_weight_options(OptionSet& options, DesignArguments& arguments) {
  const Limits limits = Limits::at_least(0);
  ObjectiveWeights& weights = arguments.design.weights;
  options.number("--smoothness", arguments.smoothness, limits, "", "factor on --weight-smooth");
  options.number("--weight-image", weights.image, limits, "", "picture term (Sun et al., Eq. 17)");
  options.number("--weight-gradient", weights.gradient, limits, "", "picture gradient term");
  options.number("--weight-boundary", weights.boundary, limits, "", "straight rim term");
  options.number("--weight-smooth", weights.smooth, limits, "", "all smoothness terms (Eq. 18)");
  options.number("--weight-barrier", weights.barrier, limits, "",
                 "barriers against collapsed facets and total internal reflection");
  options.number("--weight-edge", weights.edge, limits, "", "bending between facets, in Eq. 18");
  options.number("--weight-laplacian", weights.laplacian, limits, "",
                 "evenness of the mesh, in Eq. 18");
}

void add_design_options(OptionSet& options, DesignArguments& arguments) {
  options.positional("TARGET", arguments.target, "picture to project: PNG, JPEG, TIFF, EXR, ...");
  options.required_text("--out", arguments.out, "DIR", "lens folder to write");
  add_lens_options(options, arguments.design);
  add_effort_options(options, arguments.design);
  add_weight_options(options, arguments);
  options.flag("--resume", arguments.resume,
               "go on with the interrupted design in --out, given the same picture and options");
  options.flag("--force", arguments.force, "replace the design that --out holds");
}

/// The working resolution: what was asked for, else the default or what the picture has.
int working_pixels(const OptionSet& options, const Image& picture, int pixels) {
  const int longer = std::max(picture.columns(), picture.rows());
  if (pixels <= longer) return pixels;
  if (!options.given("--pixels")) return longer;
  throw InputError("--pixels " + std::to_string(pixels) + ": the picture's longer side has only " +
                   std::to_string(longer) + " pixels");
}

Image load_target(const DesignArguments& arguments, const Console& console) {
  LoadedImage loaded = read_image(arguments.target);
  for (const std::string& change : loaded.changes) {
    console.note(arguments.target + ": " + change);
  }
  return std::move(loaded.image);
}

void note_resolution(const Image& picture, int pixels, const Console& console) {
  if (pixels < std::max(picture.columns(), picture.rows())) {
    console.note("picture of " + size_text(picture.columns(), picture.rows()) + " resampled to " +
                 std::to_string(pixels) + " pixels on the longer side");
  }
}

nlohmann::json provenance(const OptionSet& options, const DesignResult& result) {
  const bool done = result.status == DesignResult::Status::kDone;
  return {{"program", "lensforge " + std::string(version())},
          {"options", options.used()},
          {"seconds", result.convergence.empty() ? 0.0 : result.convergence.back().seconds},
          {"device", "cpu"},
          {"threads", options.executor().concurrency()},
          {"status", done ? "done" : "interrupted"},
          {"message", result.message}};
}

void write_folder(const OutputFolder& folder, const DesignResult& result) {
  write_whole_file(folder.path() / lens_file::kConvergence, convergence_csv(result.convergence));
  write_image(draw_overview(result.lens), folder.path() / design_file::kOverview);
  write_lens(result.lens, folder.path());
}

nlohmann::json summary_json(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  return {{"command", "design"},
          {"out", folder.string()},
          {"status", lens.provenance["status"]},
          {"message", result.message},
          {"pixels", {lens.setup.pixels.x(), lens.setup.pixels.y()}},
          {"grid", {lens.surface.grid.columns, lens.surface.grid.rows}},
          {"lens_size", {lens.setup.lens_size.x(), lens.setup.lens_size.y()}},
          {"metrics",
           {{"facet", metrics_json(lens.facet_metrics)},
            {"smooth", metrics_json(lens.smooth_metrics)}}},
          {"iterations", result.convergence.size()},
          {"seconds", lens.provenance["seconds"]}};
}

std::string summary_text(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  return folder.string() + ": " + result.message + "\n" +           //
         "  facet   " + metrics_text(lens.facet_metrics) + "\n" +   //
         "  smooth  " + metrics_text(lens.smooth_metrics) + "\n" +  //
         "  " + size_text(lens.setup.pixels.x(), lens.setup.pixels.y()) + " pixels, " +
         std::to_string(lens.surface.vertex_count()) + " vertices, " +
         fixed(lens.provenance["seconds"].get<double>(), 1) + " s\n";
}

/// Stores what came out and says so. @return the exit code.
int finish(const OptionSet& options, const OutputFolder& folder, DesignResult& result) {
  if (result.status == DesignResult::Status::kFailed) throw RunError(result.message);
  const bool done = result.status == DesignResult::Status::kDone;
  result.lens.provenance = provenance(options, result);
  if (result.lens.surface.triangle_count() > 0) write_folder(folder, result);
  std::error_code ignored;
  if (done) fs::remove(folder.path() / design_file::kCheckpoint, ignored);
  const Console console(options.common().json, options.common().quiet);
  console.result(summary_json(folder.path(), result), summary_text(folder.path(), result));
  if (!done) console.note("interrupted; the same command with --resume goes on");
  return done ? kDone : kInterrupted;
}

/// Decides where a --resume starts. @return false if there is nothing left to do.
bool prepare_resume(DesignArguments& arguments, const Console& console) {
  const EarlierDesign earlier = EarlierDesign::in(arguments.out);
  if (!arguments.resume || earlier.checkpoint) return true;
  if (earlier.lens) return false;
  console.note("--resume: no checkpoint in " + arguments.out + " yet, starting at the beginning");
  arguments.resume = false;
  return true;
}

int report_finished(const DesignArguments& arguments, const Console& console) {
  console.result({{"command", "design"}, {"out", arguments.out}, {"status", "done"}},
                 arguments.out + ": the design is finished, there is nothing to resume\n");
  return kDone;
}

int run(const OptionSet& options, DesignArguments& arguments) {
  const InterruptWatch interrupt;
  const Console console(options.common().json, options.common().quiet);
  refuse_to_overwrite(arguments.out, arguments.resume, arguments.force);
  const Image target = load_target(arguments, console);
  if (!prepare_resume(arguments, console)) return report_finished(arguments, console);
  DesignOptions& design = arguments.design;
  design.pixels = working_pixels(options, target, design.pixels);
  note_resolution(target, design.pixels, console);
  const OutputFolder folder(arguments.out);
  folder.remove_partial_files();
  if (arguments.force && !arguments.resume) remove_earlier_design(folder.path());
  design.checkpoint = folder.path() / design_file::kCheckpoint;
  design.resume = arguments.resume;
  DesignResult result;
  {
    ProgressDisplay progress(options.common().quiet);
    const RunControl control(interrupt.token(), progress.sink());
    result = design_lens(target, design, options.executor(), control);
  }
  return finish(options, folder, result);
}

}  // namespace

int design_command(const Arguments& command_line) {
  DesignArguments arguments;
  OptionSet options("design", "Shapes a lens that projects a picture.");
  add_design_options(options, arguments);
  options.parse(command_line);
  arguments.design.weights.smooth *= arguments.smoothness;
  return run(options, arguments);
}

}  // namespace lensforge::app
