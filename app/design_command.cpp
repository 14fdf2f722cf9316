// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/console.h"
#include "app/earlier_design.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/interruptible_job.h"
#include "app/json_output.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/overview.h"
#include "app/progress_display.h"
#include "cam/cam_job.h"
#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/folder_lock.h"
#include "core/text/version.h"
#include "design/design_estimate.h"
#include "design/design_lens.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr int kLeastPixels = 4;  ///< Of the picture's longer side.

struct DesignArguments {
  std::string target;
  std::string out;
  DesignOptions design;
  double smoothness = 1.0;
  bool transport_alone = false;
  bool resume = false;
  bool force = false;
};

void add_lens_options(OptionSet& options, DesignOptions& design) {
  options.length("--width", design.width, Limits::between(kMinLensWidth, kMaxLensWidth),
                 "lens width; the height follows the picture");
  options.length("--focal", design.focal_length,
                 {.low = 0, .high = kMaxFocalLength, .low_excluded = true},
                 "distance from the flat face to the wall");
  options.number("--ior", design.ior, Limits::between(kMinIor, kMaxIor), "",
                 "refractive index of the lens");
  options.length("--thickness", design.thickness, Limits::between(kMinThickness, kMaxThickness),
                 "least thickness of the lens");
  options.choice("--model", design.model,
                 {{"facet", SurfaceModel::kFacet}, {"smooth", SurfaceModel::kSmooth}},
                 "what bends the light: flat facets, or a surface smooth at every vertex");
  options.choice("--view", design.view, {{"front", ViewSide::kFront}, {"rear", ViewSide::kRear}},
                 "picture seen on a wall from the lens's side, or on a screen from behind");
}

void add_effort_options(OptionSet& options, DesignArguments& arguments) {
  DesignOptions& design = arguments.design;
  options.integer("--pixels", design.pixels, Limits::at_least(kLeastPixels),
                  "longer side of the working picture, never more than the picture has");
  options.number("--mesh-ratio", design.mesh_ratio, Limits::between(0.25, 8), "",
                 "mesh vertices per pixel side");
  options.integer("--levels", design.levels, Limits::between(1, 16),
                  "resolutions from coarse to fine, each twice the one before");
  options.integer("--rounds", design.rounds, Limits::between(1, 1000), "rounds at each resolution");
  options.integer("--transport-rounds", design.transport_rounds, Limits::between(0, 1000),
                  "rounds that begin with optimal transport; 0 starts from a flat surface");
  options.flag("--no-rendering-guided", arguments.transport_alone,
               "leave out rendering-guided optimisation: transport alone");
  options.number("--spread", design.spread, Limits::between(0, 0.95), "",
                 "share of the facets spread evenly over the picture instead of the lens");
  options.integer("--update-iterations", design.update_iterations, Limits::between(0, 10000),
                  "most iterations of the correspondence-guided update (Sun et al., Eq. 20)");
  options.choice("--quality", design.iterations, {{"draft", 20}, {"standard", 100}, {"paper", 300}},
                 "most iterations of one round: 20, 100 or 300");
}

void add_weight_options(OptionSet& options, DesignArguments& arguments) {
  const Limits limits = Limits::between(0, kMaxWeight);
  ObjectiveWeights& weights = arguments.design.weights;
  options.number("--smoothness", arguments.smoothness, limits, "", "factor on --weight-smooth");
  options.number("--weight-image", weights.image, limits, "",
                 "picture values (Sun et al., Eq. 18, lambda 1)");
  options.number("--weight-gradient", weights.gradient, limits, "", "picture gradients (lambda 2)");
  options.number("--weight-boundary", weights.boundary, limits, "",
                 "light outside the picture (lambda 3)");
  options.number("--weight-smooth", weights.smooth, limits, "",
                 "all smoothness terms (lambda 4); facets take 0.00002 unless it is given");
  options.number("--weight-barrier", weights.barrier, limits, "",
                 "barriers against collapsed facets and total reflection (lambda 5)");
  options.number("--weight-edge", weights.edge, limits, "",
                 "bending across edges, within the smoothness terms (Eq. 17, tau 1)");
  options.number("--weight-laplacian", weights.laplacian, limits, "",
                 "evenness of the mesh, within the smoothness terms (Eq. 17, tau 2)");
  options.number("--weight-align", weights.align, limits, "",
                 "distance to where transport wants the light (Eq. 20, gamma 1)");
  options.number("--weight-flux", weights.flux, limits, "",
                 "change of the facets' flux by the update (Eq. 20, gamma 2)");
}

void add_design_options(OptionSet& options, DesignArguments& arguments) {
  options.positional("TARGET", arguments.target, "picture to project: PNG, JPEG, TIFF, EXR, ...");
  options.required_text("--out", arguments.out, "DIR", "lens folder to write");
  add_lens_options(options, arguments.design);
  add_effort_options(options, arguments);
  add_weight_options(options, arguments);
  options.flag("--resume", arguments.resume,
               "go on with the interrupted design in --out, given the same picture and options");
  options.flag("--force", arguments.force, "replace the design that --out holds");
}

/// The working resolution: what was asked for, else the default or what the picture has.
int working_pixels(const OptionSet& options, const DesignArguments& arguments,
                   const Image& picture) {
  const int longer = std::max(picture.columns(), picture.rows());
  const int pixels = arguments.design.pixels;
  if (longer < kLeastPixels) {
    throw InputError(arguments.target + ": has " + size_text(picture.columns(), picture.rows()) +
                     " pixels; its longer side needs at least " + std::to_string(kLeastPixels));
  }
  if (pixels <= longer) return pixels;
  if (!options.given("--pixels")) return longer;
  throw InputError("--pixels " + std::to_string(pixels) + ": the picture's longer side has only " +
                   std::to_string(longer) + " pixels");
}

/// Everything that was changed about the picture, in words.
std::vector<std::string> changes_made(const LoadedImage& loaded, const DesignArguments& arguments) {
  std::vector<std::string> changes;
  for (const std::string& change : loaded.changes) {
    changes.push_back(arguments.target + ": " + change);
  }
  const Image& picture = loaded.image;
  if (arguments.design.pixels < std::max(picture.columns(), picture.rows())) {
    changes.push_back(arguments.target + ": " + size_text(picture.columns(), picture.rows()) +
                      " pixels resampled to " + std::to_string(arguments.design.pixels) +
                      " on the longer side");
  }
  return changes;
}

/// 16 hexadecimal digits: JSON's numbers do not hold 64 bits.
std::string fingerprint_text(std::uint64_t fingerprint) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, fingerprint);
  return text.data();
}

nlohmann::json provenance(const OptionSet& options, const ChosenDevice& device,
                          const DesignResult& result) {
  const bool done = result.status == DesignResult::Status::kDone;
  return {{"program", program_mark()},
          {"options", options.used()},
          {"seconds", result.convergence.empty() ? 0.0 : result.convergence.back().seconds},
          {"device", device.word},
          {"threads", device.executor.concurrency()},
          {"status", done ? "done" : "interrupted"},
          {"message", result.message},
          {"fingerprint", fingerprint_text(result.fingerprint)}};
}

/// Puts the lens in the place of what was there. The cut of an earlier lens goes with it: milled,
/// it would not be this one.
void write_folder(const OutputFolder& folder, const DesignResult& result, const Console& console) {
  PendingFile convergence(folder.path() / lens_file::kConvergence);
  write_whole_file(convergence.beside(), convergence_csv(result.convergence));
  PendingFile overview(folder.path() / lens_file::kOverview);
  write_image(draw_overview(result.lens), overview.beside());
  write_lens(result.lens,
             folder.path());  // A disk that is full is met before any file is replaced.
  convergence.publish();
  overview.publish();
  const fs::path cut = folder.path() / lens_file::kCut;
  std::error_code ignored;
  if (!fs::is_directory(cut, ignored)) return;
  remove_cut(cut);
  if (!fs::remove(cut, ignored)) {
    console.note(cut.string() + ": holds files that lensforge did not write; they stay");
  }
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
          {"metrics", metrics_json(lens.metrics)},
          {"iterations", result.convergence.size()},
          {"seconds", lens.provenance["seconds"]}};
}

std::string summary_text(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  return folder.string() + ": " + result.message + "\n" +  //
         metrics_text(lens.metrics) +                      //
         "  " + size_text(lens.setup.pixels.x(), lens.setup.pixels.y()) + " pixels, " +
         std::to_string(lens.surface.vertex_count()) + " vertices, " +
         fixed(lens.provenance["seconds"].get<double>(), 1) + " s\n";
}

/// Stores what came out and says so. An earlier lens of another design stays until this one is
/// done. @return the exit code.
int finish(const OptionSet& options, const ChosenDevice& device, const OutputFolder& folder,
           DesignResult& result) {
  if (result.status == DesignResult::Status::kFailed) throw RunError(result.message);
  const Console console(options.common().json, options.common().quiet);
  const bool done = result.status == DesignResult::Status::kDone;
  result.lens.provenance = provenance(options, device, result);
  const EarlierDesign earlier = EarlierDesign::in(folder.path());
  const bool replaces = earlier.lens && !earlier.is_of(fingerprint_text(result.fingerprint));
  const bool keeps = replaces && !done;
  if (result.lens.surface.triangle_count() > 0 && !keeps) write_folder(folder, result, console);
  std::error_code ignored;
  if (done) fs::remove(folder.path() / lens_file::kCheckpoint, ignored);
  console.result(summary_json(folder.path(), result), summary_text(folder.path(), result));
  if (keeps) console.note(folder.path().string() + " keeps its earlier lens until then");
  if (!done) console.note("interrupted; the same command with --resume goes on");
  return done ? kDone : kInterrupted;
}

int report_finished(const DesignArguments& arguments, const Console& console) {
  console.result({{"command", "design"}, {"out", arguments.out}, {"status", "done"}},
                 arguments.out + ": the design is finished, there is nothing to resume\n");
  return kDone;
}

/// Runs the design. `begin` is called once, as soon as the library has accepted all its input.
DesignResult shape(bool quiet, const Executor& executor, const DesignOptions& design,
                   const Image& target, const std::stop_token& stop,
                   const std::function<void()>& begin) {
  std::once_flag begun;
  ProgressDisplay progress(quiet);
  const auto show = progress.sink();
  const RunControl control(stop, [&](const Progress& p) {
    std::call_once(begun, begin);
    if (show) show(p);
  });
  DesignResult result = design_lens(target, design, executor, control);
  std::call_once(begun, begin);
  return result;
}

bool is_of_lens(const std::string& name) {
  return name == lens_file::kStaging ||
         std::find(lens_file::kAll.begin(), lens_file::kAll.end(), name) != lens_file::kAll.end();
}

/// What the design is about to take. @throw InputError with the size that would fit if disk or
/// memory do not hold it.
WorkEstimate required_room(const DesignArguments& arguments, const Image& picture, int threads) {
  const auto estimate = [&](int pixels) {
    DesignOptions design = arguments.design;
    design.pixels = pixels;
    return estimate_design(picture.columns(), picture.rows(), design, threads);
  };
  const double memory = free_memory_bytes();
  const double disk = free_disk_bytes(arguments.out);
  int fits = arguments.design.pixels;
  while (fits > kLeastPixels &&
         (estimate(fits).memory_bytes > memory || estimate(fits).disk_bytes > disk)) {
    fits = fits * 9 / 10;
  }
  const WorkEstimate expected = estimate(arguments.design.pixels);
  require_room(expected, arguments.out, "--pixels " + std::to_string(arguments.design.pixels),
               "--pixels " + std::to_string(fits) + " would fit");
  return expected;
}

/// Nothing is written yet: a decoder that unpacks a whole picture without a look at the stop token
/// is left behind with the process.
LoadedImage read_target(const fs::path& path, const CommonOptions& common) {
  InterruptibleJob job(common);
  LoadedImage loaded = read_image(path, job.control());
  if (job.control().stop_requested()) throw Interrupted();
  return loaded;
}

int run(const OptionSet& options, DesignArguments& arguments) {
  const Console console(options.common().json, options.common().quiet);
  const EarlierDesign earlier = EarlierDesign::in(arguments.out);
  refuse_to_overwrite(arguments.out, earlier, arguments.resume, arguments.force);
  const LoadedImage loaded = read_target(arguments.target, options.common());
  const InterruptWatch interrupt;
  DesignOptions& design = arguments.design;
  design.pixels = working_pixels(options, arguments, loaded.image);
  if (arguments.resume && earlier.lens && !earlier.checkpoint) {
    require_finished(arguments.out, earlier,
                     fingerprint_text(design_identity(loaded.image, design)));
    return report_finished(arguments, console);
  }
  const ChosenDevice device = options.device_executor();
  const OutputFolder folder(arguments.out);
  const FolderLock lock(folder.path(), FolderLock::Kind::kExclusive);
  const WorkEstimate expected =
      required_room(arguments, loaded.image, device.executor.concurrency());
  design.checkpoint = folder.path() / lens_file::kCheckpoint;
  design.resume = arguments.resume && earlier.checkpoint;
  const auto begin = [&] {
    folder.remove_partial_files(is_of_lens);
    if (device.executor.device() != Device::kCpu) console.note("computing on " + device.word);
    for (const std::string& change : changes_made(loaded, arguments)) console.note(change);
    if (expected.seconds > kWorthTelling) console.note("takes " + estimate_words(expected));
    // A design that was killed before its first checkpoint starts at the beginning.
    if (arguments.resume && !design.resume) console.note("nothing to resume: the design begins");
  };
  DesignResult result = shape(options.common().quiet, device.executor, design, loaded.image,
                              interrupt.token(), begin);
  return finish(options, device, folder, result);
}

}  // namespace

int design_command(const Arguments& command_line) {
  DesignArguments arguments;
  OptionSet options("design", "Shapes a lens that projects a picture.");
  add_design_options(options, arguments);
  options.parse(command_line);
  ObjectiveWeights& weights = arguments.design.weights;
  if (!options.given("--weight-smooth")) {
    weights.smooth = default_smoothness(arguments.design.model);
  }
  weights.smooth *= arguments.smoothness;
  arguments.design.rendering_guided = !arguments.transport_alone;
  try {
    return run(options, arguments);
  } catch (const Interrupted&) {
    // While the picture was read: later the design ends with what it has.
    return report_error("interrupted; nothing was written", kInterrupted, options.common().json);
  }
}

}  // namespace lensforge::app
