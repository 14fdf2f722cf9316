// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/console.h"
#include "app/design_output.h"
#include "app/design_settings.h"
#include "app/earlier_design.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/interruptible_job.h"
#include "app/json_output.h"
#include "app/live_design.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/progress_display.h"
#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/checkpoint_file.h"
#include "core/io/lens_folder.h"
#include "core/optics/source_points.h"
#include "design/design_estimate.h"
#include "design/design_lens.h"
#include "design/light_setup.h"
#include "design/mpi/session.h"
#include "design/schedule/design_task.h"
#include "design/schedule/level_plan.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Everything that was changed about the picture, in words.
std::vector<std::string> changes_made(const LoadedImage& loaded, const DesignSettings& settings) {
  std::vector<std::string> changes;
  for (const std::string& change : loaded.changes) {
    changes.push_back(settings.target + ": " + change);
  }
  changes.insert(changes.end(), settings.changes.begin(), settings.changes.end());
  const Image& picture = loaded.image;
  if (settings.design.pixels < std::max(picture.columns(), picture.rows())) {
    changes.push_back(settings.target + ": " + size_text(picture.columns(), picture.rows()) +
                      " pixels resampled to " + std::to_string(settings.design.pixels) +
                      " on the longer side");
  }
  return changes;
}

/// Says so where the source hides the picture's finest detail.
void note_source(const Image& picture, const DesignOptions& design, const Console& console) {
  const Eigen::Vector2i pixels = working_size(picture.columns(), picture.rows(), design.pixels);
  const double blur = source_blur(optical_setup(design, pixels), design.thickness);
  if (!(blur > 1.0)) return;
  console.note("the source's image is " + fixed(blur, 1) +
               " pixels wide: no lens shows finer detail in this light");
}

nlohmann::json summary_json(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  nlohmann::json summary = {{"command", "design"},
                            {"out", folder.string()},
                            {"status", lens.provenance["status"]},
                            {"message", result.message},
                            {"pixels", {lens.setup.pixels.x(), lens.setup.pixels.y()}},
                            {"grid", {lens.surface.grid.columns, lens.surface.grid.rows}},
                            {"lens_size", {lens.setup.lens_size.x(), lens.setup.lens_size.y()}},
                            {"metrics", metrics_json(lens)},
                            {"iterations", result.convergence.size()},
                            {"seconds", lens.provenance["seconds"]}};
  if (result.source) summary["source_check"] = source_json(*result.source);
  if (result.colors) summary["fringe_mm"] = fringe_json(result.colors->fringe);
  if (result.made) summary["made"] = metrics_json(result.made->metrics);
  return summary;
}

std::string summary_text(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  return folder.string() + ": " + result.message + "\n" +  //
         metrics_text(lens) +                              //
         (result.colors ? fringe_text(result.colors->fringe) : "") +
         (result.made ? "  made    " + metrics_text(result.made->metrics) + "\n" : "") + "  " +
         size_text(lens.setup.pixels.x(), lens.setup.pixels.y()) + " pixels, " +
         std::to_string(lens.surface.vertex_count()) + " vertices, " +
         fixed(lens.provenance["seconds"].get<double>(), 1) + " s\n";
}

/// Stores what came out and says so. An earlier lens of another design stays until this one is
/// done. @return the exit code.
int finish(const OptionSet& options, const ChosenDevice& device, const DesignOptions& design,
           const OutputFolder& folder, DesignResult& result) {
  const Console console(options.common().json, options.common().quiet);
  const bool done = result.status == DesignResult::Status::kDone;
  result.lens.provenance = design_provenance(options, device, design, result);
  const EarlierDesign earlier = EarlierDesign::in(folder.path());
  const bool replaces = earlier.lens && !earlier.is_of(fingerprint_text(result.fingerprint));
  const bool keeps = replaces && !done;
  if (result.lens.surface.triangle_count() > 0 && !keeps) {
    write_design(folder.path(), result, console);
  }
  std::error_code ignored;
  if (done) fs::remove(folder.path() / lens_file::kCheckpoint, ignored);
  console.result(summary_json(folder.path(), result), summary_text(folder.path(), result));
  if (keeps) {
    console.note(folder.path().string() + " keeps its earlier lens until the new one is done");
  }
  if (!done) console.note("interrupted; run the same command with --resume to continue");
  return done ? kDone : kInterrupted;
}

int report_finished(const DesignSettings& settings, const Console& console) {
  console.result({{"command", "design"}, {"out", settings.out}, {"status", "done"}},
                 settings.out + ": the design is finished, there is nothing to resume\n");
  return kDone;
}

/// The page of the design, if one is asked for.
std::unique_ptr<LiveDesign> live_page(const DesignSettings& settings, const Image& picture,
                                      const Console& console) {
  if (settings.live.empty()) return nullptr;
  const DesignOptions& design = settings.design;
  Image target = working_picture(picture, design, {});
  const OpticalSetup setup = optical_setup(design, {target.columns(), target.rows()});
  auto page = std::make_unique<LiveDesign>(
      live_port(settings.live), fs::path(settings.out).filename().string(), design.checkpoint,
      DesignGoalView{std::move(target), setup, design.model});
  console.note("the design is shown at " + page->address());
  return page;
}

/// Who is told while a design runs.
struct DesignWatchers {
  /// Once, as soon as the library has accepted all its input: what no lens can do is only known
  /// after the first transport, before any share of the work is done.
  std::function<void()> begin;
  std::function<void()> look;  ///< Whenever there may be something to see.
};

/// Runs the design.
DesignResult shape(bool quiet, const Executor& executor, const DesignOptions& design,
                   const Image& target, const std::stop_token& stop,
                   const DesignWatchers& watchers) {
  std::once_flag begun;
  ProgressDisplay progress(quiet);
  const auto show = progress.sink();
  const RunControl control(stop, [&](const Progress& p) {
    if (p.done > 0.0) {
      std::call_once(begun, [&] {
        progress.wipe();
        watchers.begin();
      });
    }
    if (show) show(p);
    watchers.look();
  });
  DesignResult result = design_lens(target, design, executor, control);
  if (result.status != DesignResult::Status::kInterrupted) std::call_once(begun, watchers.begin);
  return result;
}

bool is_of_lens(const std::string& name) {
  return name == lens_file::kStaging ||
         std::find(lens_file::kAll.begin(), lens_file::kAll.end(), name) != lens_file::kAll.end();
}

/// Reads target, source's shape, front and outline. Nothing is written yet.
LoadedImage read_pictures(OptionSet& options, DesignSettings& settings) {
  InterruptibleJob job(options.common());
  LoadedImage loaded = read_target(settings, job.control());
  settle(options, settings, loaded.image, job.control());
  return loaded;
}

/// @throw InputError where mpirun has started several processes for what one process does alone.
void refuse_splines_on_ranks(const DesignOptions& design) {
  if (design.model != SurfaceModel::kSpline || rank_count() == 1) return;
  throw InputError(
      "--model spline (the default) and --made-by: designed in one process; with mpirun give "
      "--model smooth or facet");
}

int run(OptionSet& options, DesignSettings& settings) {
  const Console console(options.common().json, options.common().quiet);
  const EarlierDesign earlier = EarlierDesign::in(settings.out);
  if (!settings.live.empty()) live_port(settings.live);
  refuse_to_overwrite(settings.out, earlier, settings.resume, settings.force);
  const LoadedImage loaded = read_pictures(options, settings);
  const InterruptWatch interrupt;
  DesignOptions& design = settings.design;
  refuse_splines_on_ranks(design);
  if (settings.resume && earlier.lens && !earlier.checkpoint) {
    require_finished(settings.out, earlier,
                     fingerprint_text(design_identity(loaded.image, design)));
    return report_finished(settings, console);
  }
  design.checkpoint = fs::path(settings.out) / lens_file::kCheckpoint;
  const std::unique_ptr<LiveDesign> page = live_page(settings, loaded.image, console);
  const ChosenDevice device = options.device_executor();
  const OutputFolder folder(settings.out, FolderLock::Kind::kExclusive);
  if (EarlierDesign::in(settings.out) != earlier) {
    throw InputError("--out " + settings.out +
                     ": another command has changed what is in it; run the command again");
  }
  const WorkEstimate expected =
      require_room_for_design(loaded.image.columns(), loaded.image.rows(), design,
                              device.executor.concurrency() * rank_count(), settings.out,
                              static_cast<double>(ranks_here()) / rank_count());
  design.resume = settings.resume && earlier.checkpoint;
  if (expected.seconds > kWorthTelling) console.note("takes " + estimate_words(expected));
  const auto begin = [&] {
    console.begin();
    folder.remove_partial_files(is_of_lens);
    if (device.executor.device() != Device::kCpu) {
      const bool spline = design.model == SurfaceModel::kSpline;
      console.note("computing on " + device.word +
                   (spline ? "; the spline on the processor, unlike --model smooth or facet" : ""));
    }
    for (const std::string& change : changes_made(loaded, settings)) console.note(change);
    note_source(loaded.image, design, console);
    // A design that was killed before its first checkpoint starts at the beginning.
    if (settings.resume && !design.resume) {
      console.note("nothing to resume: started the design from the beginning");
    }
  };
  const auto look = [&page] {
    if (page) page->look();
  };
  DesignResult result = shape(options.common().quiet, device.executor, design, loaded.image,
                              interrupt.token(), {begin, look});
  return finish(options, device, design, folder, result);
}

}  // namespace

int design_command(const Arguments& command_line) {
  DesignSettings settings;
  OptionSet options("design", "Shapes a lens that projects a picture.");
  add_design_options(options, settings);
  options.parse(command_line);
  try {
    return run(options, settings);
  } catch (const Interrupted&) {
    // While the picture was read: later the design ends with what it has.
    return report_error("interrupted; nothing was written", kInterrupted, options.common().json);
  }
}

}  // namespace lensforge::app
