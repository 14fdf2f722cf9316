// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "cam/check/chart.h"
#include "cam/check/check_job.h"
#include "cam/check/wall_view.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/lens/lens.h"
#include "core/schema/toml.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Options of `lensforge check`.
struct CheckSettings {
  std::string source;
  std::vector<std::string> photos;
  std::string out;
  std::string dark;
  std::string workshop;
  std::string workshop_text;
  std::string fit;
  std::string chart;
  double chart_bar = kChartBar;
  bool force = false;
  CamOptions cam;
};

void describe(Description& d, CheckSettings& settings) {
  d.text("LENS", settings.source, "", "lens folder");
  d.texts("PHOTO", settings.photos, "",
          "photograph of the wall; several of the same view with different exposures count as one");
  d.text("--out", settings.out, "DIR", "folder for report, pictures and check.json");
  d.text("--dark", settings.dark, "PHOTO",
         "the same view and exposure with the lamp off: the room's light, which is subtracted");
  d.text("--workshop", settings.workshop, "FILE.toml",
         "the workshop that made the part; without it the default one");
  d.text("--fit", settings.fit, "FILE.toml",
         "write the workshop with what the photograph tells of it, polish.sigma or "
         "finish.pitch_error, for design --made-by and cam --workshop");
  d.text("--chart", settings.chart, "FILE.svg",
         "write a chart to print and fasten on the wall beside the picture, and check nothing; a "
         "photograph that shows it gives perspective and size for certain");
  d.length("--chart-bar", settings.chart_bar, Limits::between(1.0, 1000.0),
           "length of the chart's scale bar: to draw, or as measured on the print");
  d.flag("--force", settings.force, "replace files that lensforge did not write");
}

/// With its chart, which the photograph with the lamp off may show as well.
Photograph read_photo(const std::string& file, const Image& dark, const CheckSettings& settings,
                      CommandFrame& frame) {
  Image light = read_image(file, frame.control()).image;
  std::optional<SeenChart> chart = find_chart(light, file);
  if (!dark.empty() && (!chart || chart->marks() < kFewestMarks)) {
    chart = find_chart(dark, settings.dark);
  }
  if (chart) chart->bar = settings.chart_bar;
  Photograph photo = photograph(std::move(light), dark, file);
  photo.chart = std::move(chart);
  return photo;
}

/// @throw InputError as bracketed().
Photograph read_photos(const CheckSettings& settings, CommandFrame& frame) {
  if (settings.photos.size() > 1 && !settings.dark.empty()) {
    throw InputError("--dark " + settings.dark +
                     ": belongs to one exposure; give one PHOTO, or leave it out");
  }
  Image dark;
  if (!settings.dark.empty()) dark = read_image(settings.dark, frame.control()).image;
  if (settings.photos.size() == 1) {
    return read_photo(settings.photos.front(), dark, settings, frame);
  }
  std::vector<Photograph> exposures;
  for (const std::string& file : settings.photos) {
    exposures.push_back(read_photo(file, {}, settings, frame));
  }
  return bracketed(exposures);
}

std::vector<std::string> warnings_of(const Lens& lens, const Photograph& photo,
                                     const CheckResult& result) {
  constexpr double kFewest = 1.5;
  std::vector<std::string> warnings;
  if (!result.part) {
    warnings.push_back("the forecast is that of the lens as designed: lensforge " + result.fault);
  }
  const double pixels = result.seen_pixels / lens.setup.pixels.x();
  if (pixels < kFewest) {
    warnings.push_back("the photograph has " + fixed(pixels, 1) +
                       " pixels per pixel of the picture, 1.5 or more tell causes better; go "
                       "nearer");
  }
  if (photo.chart && !result.chart) {
    warnings.push_back(photo.name + ": shows one mark of a chart, must show " +
                       std::to_string(kFewestMarks) + " or more; checked without it");
  }
  return warnings;
}

/// @throw InputError
void read_shop(CheckSettings& settings) {
  if (settings.workshop.empty()) return;
  settings.workshop_text = read_toml_file(settings.workshop, "a workshop");
  settings.cam.workshop = parse_workshop(settings.workshop_text, settings.workshop);
}

/// The folder of --fit, which is looked at before the work. @throw InputError
std::optional<OutputFolder> place_of_fit(const CheckSettings& settings) {
  if (settings.fit.empty()) return std::nullopt;
  require_replaceable("--fit", settings.fit, settings.force);
  return std::optional<OutputFolder>(std::in_place, fs::absolute(settings.fit).parent_path(),
                                     FolderLock::Kind::kShared);
}

/// Writes --fit where there is something to write.
void write_fit(const CheckSettings& settings, const NextLens& next, std::vector<fs::path>& files,
               std::vector<std::string>& warnings) {
  if (settings.fit.empty()) return;
  if (next.values.empty()) {
    warnings.push_back("--fit " + settings.fit +
                       ": not written; the photograph names nothing of a workshop");
    return;
  }
  write_workshop(next, settings.workshop_text, settings.photos.front(), settings.fit);
  files.emplace_back(settings.fit);
}

/// What to do now.
std::vector<std::string> notes_of(const CheckSettings& settings, const NextLens& next) {
  std::vector<std::string> notes{"look at " +
                                 (fs::path(settings.out) / check_file::kReport).string()};
  std::string options = words_of(next.options);
  if (!settings.fit.empty() && !next.values.empty()) {
    options = with_word(options, "--made-by ", " ") + shell_word(settings.fit);
  }
  if (!options.empty()) notes.push_back("next lens: lensforge design PICTURE " + options);
  return notes;
}

/// @throw InputError if the file must not be replaced, or what a check needs is given.
CommandResult write_chart(CommandFrame& frame, const CheckSettings& settings) {
  if (!settings.source.empty()) {
    throw InputError("LENS " + settings.source + ": --chart writes a chart and checks nothing");
  }
  require_replaceable("--chart", settings.chart, settings.force);
  frame.begin_file(settings.chart);
  const std::string drawing = chart_drawing(settings.chart_bar);
  frame.begin_writing();
  write_whole_file(settings.chart, drawing);
  const nlohmann::json json = {{"status", "done"},
                               {"options", frame.options().used()},
                               {"files", files_json({settings.chart})}};
  return {json,
          "",
          kDone,
          {},
          {"print " + settings.chart +
           " without scaling, measure its bar, and photograph it on the wall beside the picture"}};
}

/// @throw InputError
void require_given(const char* name, bool given) {
  if (!given) throw InputError(std::string(name) + ": is missing; see lensforge check --help");
}

CommandResult run(CommandFrame& frame, CheckSettings& settings) {
  if (!settings.chart.empty()) return write_chart(frame, settings);
  require_given("LENS", !settings.source.empty());
  require_given("PHOTO", !settings.photos.empty());
  require_given("--out", !settings.out.empty());
  read_shop(settings);
  const Lens lens = read_lens(settings.source);
  validate(settings.cam, lens.setup);
  frame.begin_folder(settings.out).remove_partial_files(is_name_of_check);
  for (const char* name : kCheckFiles) {
    require_replaceable("--out", fs::path(settings.out) / name, settings.force);
  }
  const std::optional<OutputFolder> beside = place_of_fit(settings);
  const Photograph photo = read_photos(settings, frame);
  const CheckResult result =
      check_photograph(lens, settings.cam, photo, frame.executor(), frame.control());
  std::vector<std::string> warnings = warnings_of(lens, photo, result);
  std::vector<fs::path> files = write_check(result, lens, settings.cam, settings.out);
  write_fit(settings, result.next, files, warnings);
  nlohmann::json json = check_json(result, lens, settings.cam);
  json["status"] = "done";
  json["options"] = frame.options().used();
  json["files"] = files_json(files);
  std::string text = verdict_of(result, lens, settings.cam) + "\n";
  for (std::size_t k = 1; k < result.fit.found.size(); ++k) {
    text += "perhaps also: " + words_of(result.fit.found[k], lens, settings.cam) + "\n";
  }
  text += "  MAE against the target " + fixed(result.to_target.metrics.mae, 4) +
          ", against the forecast " + fixed(result.to_forecast.metrics.mae, 4) + "\n";
  return {json, text, kDone, warnings, notes_of(settings, result.next)};
}

Command<CheckSettings> check_verb() {
  return {"check", "Finds a lens's picture in a photograph of the wall and says what went wrong.",
          run};
}

}  // namespace

int check_command(const Arguments& arguments) { return run_command(check_verb(), arguments); }

CommandCall check_call() { return call_of(check_verb(), CheckSettings()); }

}  // namespace lensforge::app
