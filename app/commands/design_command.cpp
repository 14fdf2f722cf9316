// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/design_command.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/interrupt.h"
#include "app/frame/option_set.h"
#include "app/view/loopback_server.h"
#include "cam/cam.h"
#include "cam/plan/cam_options.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/svg_drawing.h"
#include "core/io/checkpoint_file.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/optics/light_source.h"
#include "core/optics/picture_blur.h"
#include "core/page/drawings.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/design.h"
#include "design/mpi/session.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Which part is made: those of `cam`, or a print.
Description part_options(CamOptions& cut) {
  Description options;
  options.word(
      "--part", cut.part,
      {{"lens", PartKind::kLens}, {"mould", PartKind::kMould}, {"print", PartKind::kPrint}},
      "mill the lens or the mould to cast it in, or print the lens and level it with a "
      "film");
  options.add(description_of(cut).at("--shrinkage"));
  return options;
}

/// @throw InputError unless nothing is said of how a part is made.
void refuse_part_options(const OptionSet& options, CamOptions& cut) {
  if (options.given("--robust")) {
    throw InputError("--robust: needs --made-by, which says how the part is made");
  }
  for (const Field& field : part_options(cut)) {
    if (options.given(field.name)) {
      throw InputError(field.name + ": needs --made-by, which says how the part is made");
    }
  }
}

void note_changes(DesignSettings& settings, const std::string& picture,
                  const std::vector<std::string>& changes) {
  for (const std::string& change : changes) {
    settings.changes.push_back(joined({picture, ": ", change}));
  }
}

/// Checks that a drawing has the requested number of pixels. @throw InputError naming a --pixels
/// that works.
void require_wide_drawing(const Image& drawing, const DesignSettings& settings) {
  const int shorter = std::min(drawing.columns(), drawing.rows());
  if (shorter >= kMinPixels) return;
  // The shorter side was rounded, up by a half at most, and will be rounded again.
  const double least = (kMinPixels - 0.5) * settings.design.pixels / (shorter - 0.5);
  const bool possible = least <= kMaxImageSide;
  throw InputError(
      settings.target + ": is " + size_text(drawing.columns(), drawing.rows()) +
      " pixels with --pixels " + std::to_string(settings.design.pixels) +
      "; its shorter side needs at least " + std::to_string(kMinPixels) +
      (possible ? "; --pixels " + std::to_string(static_cast<int>(std::ceil(least))) + " works"
                : ": draw it less narrow"));
}

void describe(Description& d, ColorOptions& color) {
  constexpr const char* kLamps = "--lamps";
  d.word("--color", color.way, {{"grey", ColorWay::kGrey}, {"three-lamps", ColorWay::kThreeLamps}},
         "project the picture's brightness, or its colours by three lenses side by side, each "
         "with a lamp of its own, whose pictures add up at one place");
  d.text(
      {.name = kLamps,
       .help = "wavelengths of the three lamps, nm: red, green, blue",
       .unit = "R,G,B"},
      [&color] { return numbers_text(color.lamps); },
      [&color](const std::string& text) {
        std::ranges::copy(parse_numbers(text, kLamps, 3), color.lamps.begin());
      });
  d.length("--lamp-gap", color.gap, Limits::between(0.0, kMaxLensWidth),
           "between the three lenses of --color three-lamps");
}

}  // namespace

void describe(Description& d, DesignSettings& settings) {
  d.text("TARGET", settings.target, "", "picture to project: PNG, JPEG, TIFF, EXR, SVG, ...")
      .needed = true;
  d.text("--out", settings.out, "DIR", "lens folder to write").needed = true;
  describe(d, settings.design);
  describe(d, settings.design.light);
  describe(d, settings.design.second);
  d.text("--outline", settings.outline, "rectangle|circle|rounded:R|FILE",
         "edge of the lens: the largest circle, corners of radius R, or the shape that is white "
         "in a picture, seen from the cutter's side")
      .essential = true;
  describe(d, settings.background);
  describe(d, settings.color);
  describe(d, settings.design.weights);
  d.text("--made-by", settings.made_by, "default|FILE.toml",
         "shape the part that this workshop cuts and polishes, not the surface alone")
      .essential = true;
  d.flag("--robust", settings.robust,
         "with --made-by: right on average over parts that are polished less and more by the "
         "workshop's tolerances.polish_sigma; takes twice as long");
  d.add(part_options(settings.cut));
  d.text("--live", settings.live, "PORT",
         "serve a page that shows the design while it runs, to browsers on this machine; 0 "
         "takes a free port");
  d.flag("--resume", settings.resume,
         "continue the interrupted design in --out, with the same picture and options")
      .essential = true;
  d.flag("--force", settings.force, "replace the design that --out holds");
}

LoadedImage read_target(const DesignSettings& settings, const RunControl& control) {
  LoadedImage loaded =
      read_image(settings.target, control, settings.design.pixels, settings.background);
  if (control.stop_requested()) throw Interrupted();
  std::ifstream file = open_input(settings.target);
  if (is_svg(file)) require_wide_drawing(loaded.image, settings);
  return loaded;
}

namespace {

/// Options of schedules that two pictures do not have.
constexpr std::array kOnePicture{"--levels",     "--rounds",
                                 "--mesh-ratio", "--transport-rounds",
                                 "--spread",     "--no-rendering-guided",
                                 "--smoothness", "--update-iterations"};

/// Reads the picture of --second. @throw InputError; Interrupted.
void read_second(const OptionSet& options, DesignSettings& settings, const RunControl& control) {
  SecondOptions& second = settings.design.second;
  if (second.file.empty()) return;
  for (const char* name : kOnePicture) {
    if (!options.given(name)) continue;
    throw InputError(std::string(name) +
                     ": has no effect on two pictures, whose rounds follow from --quality; leave "
                     "it out with --second");
  }
  if (!settings.live.empty()) {
    throw InputError("--live " + settings.live + ": shows one picture; leave it out with --second");
  }
  LoadedImage loaded =
      read_image(second.file, control, settings.design.pixels, settings.background);
  note_changes(settings, "--second " + second.file, loaded.changes);
  second.picture = std::make_shared<const Image>(std::move(loaded.image));
}

}  // namespace

void settle(OptionSet& options, DesignSettings& settings, const Image& picture,
            const RunControl& control) {
  const int longer = std::max(picture.columns(), picture.rows());
  if (longer < kMinPixels) {
    throw InputError(settings.target + ": has " + size_text(picture.columns(), picture.rows()) +
                     " pixels; its longer side needs at least " + std::to_string(kMinPixels));
  }
  if (!(picture.total() > 0.0)) {
    throw InputError(settings.target +
                     ": is black all over: there is no light to place; use a picture with some");
  }
  if (settings.made_by.empty()) {
    refuse_part_options(options, settings.cut);
    if (!options.given("--model")) {
      const int pixels = std::min(settings.design.pixels, longer);
      settings.design.model =
          default_model(working_size(picture.columns(), picture.rows(), pixels), settings.design);
    }
  } else {
    if (options.given("--model") && settings.design.model != SurfaceModel::kSpline) {
      throw InputError("--made-by " + settings.made_by + ": needs --model spline, not " +
                       model_name(settings.design.model));
    }
    validate_shrinkage(settings.cut);
    settings.design.model = SurfaceModel::kSpline;
    if (settings.made_by != "default") {
      settings.cut.workshop = read_workshop(settings.made_by);
      (void)post_of(settings.cut.workshop,
                    settings.made_by);  // A wrong one is named before the design.
    }
  }
  settings.design = default_design_options(settings.design.model, picture);
  options.restate();
  LightOptions& light = settings.design.light;
  note_changes(settings, "--source-picture " + light.source_picture,
               read_lamp(light, settings.background, control));
  if (!light.front_file.empty()) light.front_heights = front_from(light.front_file, control);
  read_second(options, settings, control);
  if (!settings.outline.empty()) {
    OutlineChoice choice = outline_from(settings.outline, settings.background, control);
    note_changes(settings, "--outline " + settings.outline, choice.changes);
    settings.design.outline = std::move(choice.outline);
  }
  if (!settings.made_by.empty()) settings.design.made_by = made_by(settings.cut, settings.robust);
  validate(settings.design, picture);
}

namespace {

/// A lens.json is a few kilobytes.
constexpr std::uintmax_t kMaxJson = 1 << 20;

/// True if the content shows that lensforge wrote this file of a lens folder.
bool is_own(const fs::path& path) {
  std::error_code ignored;
  if (fs::file_size(path, ignored) == 0) return true;
  if (path.filename() == lens_file::kConvergence) {
    return file_starts_with(path, convergence_csv({}));
  }
  if (path.filename() == lens_file::kSpline) return is_spline_file(path);
  return written_by_lensforge(path);
}

/// Null if the file cannot be parsed; callers that need it report that.
nlohmann::json provenance_of(const fs::path& json) {
  const std::string text = read_whole_file(json, kMaxJson);
  try {
    const nlohmann::json document = parse_json(text, json.string());
    return document.is_object() ? document.value("provenance", nlohmann::json()) : nlohmann::json();
  } catch (const InputError&) {
    return nullptr;
  }
}

[[noreturn]] void refuse(const fs::path& folder, const std::string& holds) {
  throw InputError("--out " + folder.string() + ": holds " + holds);
}

/// Refuses what no option lets a design replace.
void require_files(const fs::path& folder) {
  for (const char* name : lens_file::kAll) {
    std::error_code ignored;
    const fs::file_status status = fs::status(folder / name, ignored);
    if (!fs::exists(status) || fs::is_regular_file(status)) continue;
    refuse(folder, std::string(name) + ", which is no regular file; choose another folder");
  }
}

}  // namespace

EarlierDesign EarlierDesign::in(const fs::path& folder) {
  std::error_code ignored;
  EarlierDesign earlier;
  for (const char* name : lens_file::kAll) {
    const fs::path path = folder / name;
    if (!fs::is_regular_file(path, ignored)) continue;
    if (name == std::string_view(lens_file::kJson)) {
      earlier.lens = true;
      earlier.provenance = provenance_of(path);
    } else if (name == std::string_view(lens_file::kCheckpoint)) {
      earlier.checkpoint = true;
    } else if (!is_own(path)) {
      earlier.foreign.emplace_back(name);
    }
  }
  return earlier;
}

bool EarlierDesign::is_of(const std::string& fingerprint) const {
  return provenance.is_object() && provenance.value("fingerprint", nlohmann::json()) == fingerprint;
}

void refuse_to_overwrite(const fs::path& folder, const EarlierDesign& earlier, bool resume,
                         bool force) {
  require_files(folder);
  if (force || (resume && earlier.lens)) return;
  if (!resume && (earlier.lens || earlier.checkpoint)) {
    refuse(folder, std::string(earlier.lens ? "a lens" : "an unfinished design") +
                       " already; choose another folder, go on with --resume or replace it with "
                       "--force");
  }
  if (earlier.foreign.empty()) return;
  refuse(folder, earlier.foreign.front() +
                     " already, which lensforge did not write; choose another folder or replace "
                     "it with --force");
}

namespace {

/// @throw InputError if the finished lens that --resume meets is not what the same picture and
///        options give, or its design was never finished and its checkpoint is gone.
/// @pre earlier.lens && !earlier.checkpoint
void require_finished(const fs::path& folder, const EarlierDesign& earlier,
                      const std::string& fingerprint) {
  if (!earlier.provenance.is_object()) refuse(folder, "a lens.json that cannot be understood");
  if (earlier.provenance.value("status", nlohmann::json()) == "interrupted") {
    refuse(folder, std::string("an unfinished design whose ") + lens_file::kCheckpoint +
                       " is missing: nothing to resume; start again with --force");
  }
  if (earlier.provenance.contains("fingerprint") && !earlier.is_of(fingerprint)) {
    refuse(folder,
           "the finished lens of another picture or other options: there is nothing to resume; "
           "choose another folder or replace it with --force");
  }
}

std::string picture_bytes(const Image& image) {
  const std::vector<unsigned char> png = encode_png(grey_picture(image));
  return {png.begin(), png.end()};
}

/// Shows a running design to browsers on this machine. A thread of its own looks at what the design
/// has saved after every round.
class LiveDesign {
 public:
  /// @param port  0 takes a free one. @throw InputError if it cannot be had.
  LiveDesign(int port, const std::string& name, std::filesystem::path checkpoint,
             DesignGoalView goal);
  ~LiveDesign();
  LiveDesign(const LiveDesign&) = delete;
  LiveDesign& operator=(const LiveDesign&) = delete;

  [[nodiscard]] std::string address() const { return server_.address(); }
  /// Something may have been saved. Returns at once.
  void look();

 private:
  void watch(const std::stop_token& stop);

  std::filesystem::path checkpoint_;
  DesignGoalView goal_;
  LiveServer server_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool asked_ = false;
  std::jthread watcher_;  ///< Last, so that it ends first.
};

LiveDesign::LiveDesign(int port, const std::string& name, fs::path checkpoint, DesignGoalView goal)
    : checkpoint_(std::move(checkpoint)),
      goal_(std::move(goal)),
      server_(port, name, picture_bytes(goal_.target), [] { InterruptWatch::interrupt(); }),
      watcher_([this](const std::stop_token& stop) { watch(stop); }) {}

LiveDesign::~LiveDesign() {
  watcher_.request_stop();
  watcher_.join();
}

void LiveDesign::look() {
  {
    const std::lock_guard lock(mutex_);
    asked_ = true;
  }
  wake_.notify_one();
}

void LiveDesign::watch(const std::stop_token& stop) {
  fs::file_time_type seen = fs::file_time_type::min();
  const Executor executor = Executor::cpu(1).with_stop(stop);
  for (std::int64_t number = 1; !stop.stop_requested();) {
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return asked_; })) return;
      asked_ = false;
    }
    std::error_code none;
    const fs::file_time_type saved = fs::last_write_time(checkpoint_, none);
    if (none || saved == seen) continue;
    seen = saved;
    try {
      server_.publish(state_of_design(checkpoint_, goal_, number, executor));
      ++number;
    } catch (const std::exception&) {
      // The design itself reports a bad checkpoint and ends if it cannot continue.
    }
  }
}

/// Accuracy of the picture under an extended source.
nlohmann::json source_json(const SourceCheck& source) {
  return {{"blur_pixels", source.blur},
          {"points", source.points},
          {"halving_mae", source.halving},
          {"convolution_mae", source.convolution}};
}

/// Distance between the colours' landing points, mm.
nlohmann::json fringe_json(const Fringe& fringe) {
  return {{"mean", fringe.mean}, {"max", fringe.max}};
}

/// The process that a design is for and what comes out of it.
nlohmann::json made_json(const MadeBy& process, const DesignResult::Made& made) {
  return {{"pitch_mm", process.pitch},
          {"along", process.rows_along_x ? "x" : "y"},
          {"polish_sigma_mm", process.polish_sigma},
          {"polish_order", process.polish_order},
          {"polish_floor", process.polish_floor},
          {"roughness_nm", process.roughness},
          {"correlation_um", process.correlation},
          {"rim_depth_mm", process.rim_depth},
          {"rim_length_mm", process.rim_length},
          {"polish_spread", process.polish_spread},
          {"metrics", metrics_json(made.metrics)}};
}

nlohmann::json waves_json(const DesignResult::Wall& wall) {
  nlohmann::json fields = metrics_json(wall.metrics);
  fields["wavelength_nm"] = wall.wavelength / kMmPerNm;
  return fields;
}

}  // namespace

nlohmann::json design_provenance(const OptionSet& options, const ChosenDevice& device,
                                 const DesignOptions& design, const DesignResult& result) {
  const bool done = result.status == DesignResult::Status::kDone;
  nlohmann::json fields = {
      {"program", program_mark()},
      {"options", options.used()},
      {"seconds", result.convergence.empty() ? 0.0 : result.convergence.back().seconds},
      {"device", device.word},
      {"threads", device.executor.concurrency()},
      {"status", done ? "done" : "interrupted"},
      {"message", result.message},
      {"fingerprint", fingerprint_text(result.fingerprint)}};
  if (result.source) fields["source_check"] = source_json(*result.source);
  if (result.colors) fields["fringe_mm"] = fringe_json(result.colors->fringe);
  if (result.made) fields["made_by"] = made_json(*design.made_by, *result.made);
  if (result.wall) fields["waves"] = waves_json(*result.wall);
  return fields;
}

void write_design(const fs::path& folder, const DesignResult& result, const Console& console) {
  PendingFiles files(folder);
  files.add(lens_file::kConvergence, convergence_csv(result.convergence));
  files.add(lens_file::kOverview, [&](const fs::path& beside) {
    write_image(draw_overview(result.lens, result.pictures()), beside);
  });
  files.add(lens_file::kSetup,
            light_drawing_file(result.lens.setup, result.lens.surface.vertices.row(2).maxCoeff()));
  if (result.colors) {
    files.add(lens_file::kRenderColor,
              [&](const fs::path& beside) { write_image(result.colors->picture, beside); });
  }
  if (result.wall) {
    files.add(lens_file::kWall,
              [&](const fs::path& beside) { write_image(result.wall->picture, beside); });
  }
  write_lens(result.lens, std::move(files));
  std::error_code ignored;
  if (!result.colors) fs::remove(folder / lens_file::kRenderColor, ignored);
  if (!result.wall) fs::remove(folder / lens_file::kWall, ignored);
  for (const char* const name : {lens_file::kCut, lens_file::kFrontCut}) {
    const fs::path cut = folder / name;
    if (!fs::is_directory(cut, ignored)) continue;
    remove_cut(cut);
    if (!fs::remove(cut, ignored)) {
      console.note(cut.string() + ": holds files that lensforge did not write; they are kept");
    }
  }
}

namespace {

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

/// Pixels of a blur from which on a picture is too fine for its light. Diffraction blurs one at the
/// default distance and size, which a picture survives.
double worth_telling(const PictureBlur& blur) { return blur.cause == "lamp" ? 1.0 : 1.5; }

/// Prints a note if the light blurs the picture's finest detail.
void note_blur(const Image& picture, const DesignOptions& design, const Console& console) {
  const Eigen::Vector2i pixels = working_size(picture.columns(), picture.rows(), design.pixels);
  const OpticalSetup setup = optical_setup(design, pixels);
  const std::vector<PictureBlur> blurs =
      light_blurs(setup, design.thickness, middle_wavelength(setup));
  const PictureBlur& most = widest(blurs);
  if (!(most.pixels > worth_telling(most))) return;
  const int enough =
      std::max(kMinPixels, static_cast<int>(std::ceil(pixels.maxCoeff() / most.pixels)));
  console.note(blur_words(blurs) + ": no lens shows finer detail in this light; --pixels " +
               std::to_string(enough) + " shows all of it, " + blur_remedy(most.cause) +
               " shows more");
}

std::vector<PictureBlur> blurs_of(const Lens& lens) {
  const double height = lens.surface.vertices.row(2).mean();
  return light_blurs(lens.setup, height, middle_wavelength(lens.setup));
}

nlohmann::json summary_json(const fs::path& folder, const DesignResult& result) {
  const Lens& lens = result.lens;
  nlohmann::json summary = {{"out", folder.string()},
                            {"status", lens.provenance.json()["status"]},
                            {"message", result.message},
                            {"pixels", {lens.setup.pixels.x(), lens.setup.pixels.y()}},
                            {"grid", {lens.surface.grid.columns, lens.surface.grid.rows}},
                            {"lens_size", {lens.setup.lens_size.x(), lens.setup.lens_size.y()}},
                            {"metrics", metrics_json(lens)},
                            {"iterations", result.convergence.size()},
                            {"seconds", lens.provenance.json()["seconds"]}};
  summary["blur"] = blurs_json(blurs_of(lens));
  if (result.source) summary["source_check"] = source_json(*result.source);
  if (result.colors) summary["fringe_mm"] = fringe_json(result.colors->fringe);
  if (result.made) summary["made"] = metrics_json(result.made->metrics);
  if (result.wall) summary["waves"] = waves_json(*result.wall);
  return summary;
}

/// Why cam's or plan's figure of the same part is another one.
const char* made_words(const DesignSettings& settings) {
  return settings.cut.part == PartKind::kPrint
             ? "          as printed and levelled, without steps; plan says what they add\n"
             : "          as cut and polished on average; cam adds its paths' errors and what the "
               "ball rounds\n";
}

std::string summary_text(const fs::path& folder, const DesignSettings& settings,
                         const DesignResult& result) {
  const Lens& lens = result.lens;
  return folder.string() + ": " + result.message + "\n" +  //
         metrics_text(lens) + second_text(lens) +          //
         (result.colors ? fringe_text(result.colors->fringe) : "") +
         (result.made
              ? "  made    " + metrics_text(result.made->metrics) + "\n" + made_words(settings)
              : "") +
         (result.wall ? "  by waves " + metrics_text(result.wall->metrics) + "\n" : "") +
         "  on the wall " + blur_words(blurs_of(lens)) + "\n  " +
         size_text(lens.setup.pixels.x(), lens.setup.pixels.y()) + " pixels, " +
         std::to_string(lens.surface.vertex_count()) + " vertices, " +
         fixed(lens.provenance.json()["seconds"].get<double>(), 1) + " s\n";
}

/// The command that cuts the lens, in the workshop that it was designed for, or hands it to a
/// printer.
std::string making_words(const DesignSettings& settings, const fs::path& folder) {
  if (settings.cut.part == PartKind::kPrint) {
    return "lensforge export " + shell_word(folder.string()) + " --out " +
           shell_word(folder.string() + ".stl");
  }
  const bool named = !settings.made_by.empty() && settings.made_by != "default";
  return "lensforge cam " + shell_word(folder.string()) +
         (named ? " --workshop " + shell_word(settings.made_by) : std::string());
}

/// Saves the result. An earlier lens of another design stays until this one is done.
CommandResult finish(CommandFrame& frame, const ChosenDevice& device,
                     const DesignSettings& settings, const fs::path& folder, DesignResult& result) {
  const DesignOptions& design = settings.design;
  const bool done = result.status == DesignResult::Status::kDone;
  result.lens.provenance = design_provenance(frame.options(), device, design, result);
  const EarlierDesign earlier = EarlierDesign::in(folder);
  const bool replaces = earlier.lens && !earlier.is_of(fingerprint_text(result.fingerprint));
  const bool keeps = replaces && !done;
  if (result.lens.surface.triangle_count() > 0 && !keeps) {
    frame.control().report({"writing the lens", 0.0, 0.0, ""});
    write_design(folder, result, frame.console());
  }
  std::error_code ignored;
  if (done) fs::remove(folder / lens_file::kCheckpoint, ignored);
  CommandResult outcome{summary_json(folder, result), summary_text(folder, settings, result),
                        exit_code(done)};
  if (keeps) {
    outcome.notes.push_back(folder.string() + " keeps its earlier lens until the new one is done");
  }
  if (done) {
    outcome.notes.push_back("look at " + (folder / lens_file::kOverview).string() +
                            "; then: " + making_words(settings, folder));
  } else {
    outcome.notes.emplace_back(kContinueWithResume);
  }
  return outcome;
}

/// The page of the design, if one is asked for.
std::unique_ptr<LiveDesign> live_page(const DesignSettings& settings, const Image& picture,
                                      const Console& console) {
  if (settings.live.empty()) return nullptr;
  const DesignOptions& design = settings.design;
  Image target = working_picture(picture, design, {});
  const OpticalSetup setup = optical_setup(design, {target.columns(), target.rows()});
  auto page = std::make_unique<LiveDesign>(
      loopback_port("--live", settings.live), fs::path(settings.out).filename().string(),
      design.checkpoint, DesignGoalView{std::move(target), setup, design.model});
  console.note("the design is shown at " + page->address());
  return page;
}

/// Runs the design. Impossible requests are only detected after the first transport, before any
/// work is reported as done. @param accepted  called once after that, unless it is interrupted.
DesignResult shape(CommandFrame& frame, const Executor& executor, const DesignOptions& design,
                   const Image& target, LiveDesign* page, std::function<void()> accepted) {
  const RunControl shown = frame.control(std::move(accepted));
  const RunControl control(shown.stop_token(), [&](const Progress& progress) {
    shown.report(progress);
    if (page != nullptr) page->look();
  });
  DesignResult result = design_lens(target, design, executor, control);
  if (result.status != DesignResult::Status::kInterrupted) frame.accept();
  return result;
}

bool is_of_lens(const std::string& name) {
  return name == lens_file::kStaging ||
         std::find(lens_file::kAll.begin(), lens_file::kAll.end(), name) != lens_file::kAll.end();
}

/// Reads target, source's shape, front and outline. Nothing is written yet.
LoadedImage read_pictures(CommandFrame& frame, DesignSettings& settings) {
  frame.begin_file();
  const RunControl control = frame.control();
  LoadedImage loaded = read_target(settings, control);
  settle(frame.options(), settings, loaded.image, control);
  return loaded;
}

/// @throw InputError where mpirun has started several processes for what one process does alone.
void refuse_splines_on_ranks(const DesignOptions& design) {
  if (design.model != SurfaceModel::kSpline || rank_count() == 1) return;
  throw InputError(
      "--model spline (the default) and --made-by: designed in one process; with mpirun give "
      "--model smooth or facet");
}

/// Notes what was accepted, once a design can no longer be refused.
void note_begin(const DesignSettings& settings, const LoadedImage& loaded,
                const ChosenDevice& device, const Console& console) {
  const DesignOptions& design = settings.design;
  console.begin();
  if (device.executor.device() != Device::kCpu) {
    const bool spline = design.model == SurfaceModel::kSpline;
    console.note("computing on " + device.word +
                 (spline ? "; the spline on the processor, unlike --model smooth or facet" : ""));
  }
  for (const std::string& change : changes_made(loaded, settings)) console.note(change);
  note_blur(loaded.image, design, console);
  // A design that was killed before its first checkpoint starts at the beginning.
  if (settings.resume && !design.resume) {
    console.note("nothing to resume: started the design from the beginning");
  }
}

}  // namespace

CommandResult design_for(CommandFrame& frame, DesignSettings& settings, const LoadedImage& loaded,
                         const EarlierDesign& earlier) {
  const Console& console = frame.console();
  DesignOptions& design = settings.design;
  refuse_splines_on_ranks(design);
  if (settings.resume && earlier.lens && !earlier.checkpoint) {
    require_finished(settings.out, earlier,
                     fingerprint_text(design_identity(loaded.image, design)));
    return {{{"out", settings.out}, {"status", "done"}},
            settings.out + ": the design is finished, there is nothing to resume\n"};
  }
  design.checkpoint = fs::path(settings.out) / lens_file::kCheckpoint;
  const OutputFolder& folder = frame.begin_folder(settings.out);
  const std::unique_ptr<LiveDesign> page = live_page(settings, loaded.image, console);
  const ChosenDevice device = frame.device_executor();
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
  DesignResult result = shape(frame, device.executor, design, loaded.image, page.get(), [&] {
    folder.remove_partial_files(is_of_lens);
    note_begin(settings, loaded, device, console);
  });
  return finish(frame, device, settings, settings.out, result);
}

namespace {

CommandResult run(CommandFrame& frame, DesignSettings& settings) {
  if (settings.color.way == ColorWay::kThreeLamps) return run_three_lamps(frame, settings);
  const EarlierDesign earlier = EarlierDesign::in(settings.out);
  if (!settings.live.empty()) loopback_port("--live", settings.live);
  refuse_to_overwrite(settings.out, earlier, settings.resume, settings.force);
  const LoadedImage loaded = read_pictures(frame, settings);
  return design_for(frame, settings, loaded, earlier);
}

}  // namespace

int design_command(const Arguments& arguments) {
  return run_command<DesignSettings>(
      {"design", "Shapes a lens that projects a picture.", run,
       "lensforge design photo.jpg --out lens --width 60mm --focal 200mm"},
      arguments);
}

}  // namespace lensforge::app
