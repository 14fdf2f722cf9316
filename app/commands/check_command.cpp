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
#include "cam/check/lamp_picture.h"
#include "cam/check/wall_model.h"
#include "cam/check/wall_view.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/lens/lens.h"
#include "core/schema/description.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

// --lamp-from: the picture of a lamp from a photograph of the wall.

/// Its options.
struct LampFrom {
  std::string photo;      ///< Empty: no lamp is asked for.
  Pinhole pinhole;        ///< Without a lens.
  double diameter = 0.0;  ///< Of the hole, mm; 0: not known.
  double distance = 0.0;  ///< Of the lamp from the hole, mm; 0: far away.
};

/// What else it takes of `check`.
struct LampTask {
  LampFrom lamp;
  std::string lens;  ///< Folder; empty: a pinhole.
  std::string dark;
  std::string out;
  bool force = false;
  CamOptions cam;
};

constexpr double kMrad = 1e3;

/// A measured width, to a hundredth.
std::string measured_text(double value) { return number_text(to_digits(value, 0.01 * value)); }

void describe(Description& d, LampFrom& lamp) {
  constexpr double kLeast = 0.01;
  constexpr double kMost = 1e5;
  d.text("--lamp-from", lamp.photo, "PHOTO",
         "write the lamp's picture, source.png for design --source-picture, from a photograph of "
         "the wall: behind LENS, or without it behind a pinhole");
  d.length("--pinhole-distance", lamp.pinhole.distance, Limits::zero_or(kLeast, kMost),
           "of the pinhole from the wall, with --lamp-from");
  d.length("--photo-width", lamp.pinhole.photo_width, Limits::zero_or(kLeast, kMost),
           "width of the wall that the photograph of a pinhole's image shows");
  d.length("--pinhole-diameter", lamp.diameter, Limits::zero_or(kLeast, kMost),
           "of the pinhole: says how much it blurs; 0: not known");
  d.length("--lamp-distance", lamp.distance, Limits::zero_or(kLeast, kMost),
           "of the lamp from the pinhole: gives its width in mm in place of an angle; 0: far away");
}

/// Options of a pinhole alone, and whether they are given.
std::vector<std::pair<const char*, bool>> pinhole_options(const LampFrom& lamp) {
  return {{"--pinhole-distance", lamp.pinhole.distance > 0.0},
          {"--photo-width", lamp.pinhole.photo_width > 0.0},
          {"--pinhole-diameter", lamp.diameter > 0.0},
          {"--lamp-distance", lamp.distance > 0.0}};
}

/// @throw InputError if the options do not fit each other.
void require_task(const LampTask& task) {
  for (const auto& [name, given] : pinhole_options(task.lamp)) {
    if (given && task.lamp.photo.empty()) {
      throw InputError(std::string(name) + ": is of --lamp-from; name a photograph with it");
    }
    if (given && !task.lens.empty()) {
      throw InputError(std::string(name) + ": is of a pinhole, which has no lens; leave out " +
                       task.lens + ", or this option");
    }
  }
  if (task.lamp.photo.empty() || !task.lens.empty()) return;
  if (task.lamp.pinhole.distance == 0.0 || task.lamp.pinhole.photo_width == 0.0) {
    throw InputError("--lamp-from " + task.lamp.photo +
                     ": without LENS needs the scale of a pinhole's image: --pinhole-distance "
                     "800mm and --photo-width 200mm, what the photograph shows of the wall");
  }
}

/// "9.3 mrad" or "3 mm".
std::string width_words(double width, bool is_size) {
  return is_size ? measured_text(width) + " mm" : measured_text(kMrad * width) + " mrad";
}

/// How wide the hole makes the image of a point, as an angle from the hole.
std::string hole_words(const LampFrom& lamp) {
  constexpr double kGreen = 550e-6;  // mm
  if (lamp.diameter == 0.0) return "";
  const double near = lamp.distance > 0.0 ? 1.0 / lamp.distance : 0.0;
  const double shadow = lamp.diameter * (1.0 / lamp.pinhole.distance + near);
  return "  the pinhole blurs it by " + width_words(shadow, false) + " (its diameter) and " +
         width_words(kGreen / lamp.diameter, false) + " (diffraction)\n";
}

/// A lamp, how its width is stated, and the options of `design` for it but the picture.
struct MeasuredLamp {
  LampPicture picture;
  bool is_size = false;  ///< mm; else rad.
  std::vector<NextLens::Option> options;

  /// Of what is lit.
  [[nodiscard]] double width() const { return picture.lit * picture.width; }
  void add_width() {
    if (is_size) {
      options.push_back({"--source-size", measured_text(picture.width) + "mm"});
    } else {
      options.push_back({"--source-angle", measured_text(kMrad * picture.width)});
    }
  }
};

MeasuredLamp by_pinhole(const LampTask& task, const Photograph& photo) {
  MeasuredLamp lamp{lamp_by_pinhole(photo, task.lamp.pinhole), task.lamp.distance > 0.0, {}};
  if (lamp.is_size) {
    lamp.picture.width *= task.lamp.distance;
    lamp.options = {{"--source", "point"},
                    {"--source-distance", number_text(task.lamp.distance) + "mm"}};
  }
  lamp.add_width();
  return lamp;
}

MeasuredLamp by_lens(CommandFrame& frame, const LampTask& task, const Photograph& photo) {
  const Lens lens = read_lens(task.lens);
  validate(task.cam, lens.setup);
  MeasuredLamp lamp{lamp_by_lens(lens, task.cam, photo, frame.executor(), frame.control()),
                    lamp_distance(lens.setup).has_value(),
                    {}};
  lamp.add_width();
  return lamp;
}

nlohmann::json lamp_json(const MeasuredLamp& lamp) {
  const LampPicture& picture = lamp.picture;
  const double unit = lamp.is_size ? 1.0 : kMrad;
  nlohmann::json json = {{lamp.is_size ? "size_mm" : "angle_mrad", unit * lamp.width()},
                         {"pixels_across", picture.pixels}};
  if (picture.residual > 0.0) json["residual"] = picture.residual;
  return json;
}

std::vector<std::string> lamp_warnings(const LampPicture& lamp) {
  constexpr double kMuch = 0.04;
  if (lamp.residual < kMuch) return {};
  return {"lens and lamp leave " + fixed(lamp.residual, 3) +
          " of a display value unexplained: something else is wrong, too, and is in the lamp's "
          "picture; take the image of a pinhole"};
}

/// Writes source.png. @throw InputError as lamp_by_pinhole() and lamp_by_lens().
CommandResult measure_lamp(CommandFrame& frame, const LampTask& task) {
  require_task(task);
  const fs::path file = fs::path(task.out) / check_file::kLamp;
  frame.begin_folder(task.out).remove_partial_files(is_name_of_check);
  require_replaceable("--out", file, task.force);
  Image dark;
  if (!task.dark.empty()) dark = read_image(task.dark, frame.control()).image;
  const Photograph photo =
      photograph(read_image(task.lamp.photo, frame.control()).image, dark, task.lamp.photo);
  const MeasuredLamp lamp =
      task.lens.empty() ? by_pinhole(task, photo) : by_lens(frame, task, photo);
  write_image(lamp.picture.light, file);
  nlohmann::json design = {{"source-picture", file.string()}};
  for (const auto& option : lamp.options) design[option.name.substr(2)] = option.value;
  const nlohmann::json json = {{"lamp", lamp_json(lamp)},
                               {"next", {{"design", design}}},
                               {"status", "done"},
                               {"options", frame.options().used()},
                               {"files", files_json({file})}};
  const std::string text = "The lamp is " + width_words(lamp.width(), lamp.is_size) + " wide, " +
                           fixed(lamp.picture.pixels, 0) + " pixels of the photograph\n" +
                           hole_words(task.lamp);
  return {json,
          text,
          kDone,
          lamp_warnings(lamp.picture),
          {"next lens: lensforge design PICTURE --source-picture " + shell_word(file.string()) +
           " " + words_of(lamp.options)}};
}

// The check itself.

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
  LampFrom lamp;
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
  describe_light(d, settings.cam, "the forecast");
  describe(d, settings.lamp);
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

/// Writes --fit where there is something to write. @return true if it did.
bool write_fit(const CheckSettings& settings, const NextLens& next, std::vector<fs::path>& files,
               std::vector<std::string>& warnings) {
  if (settings.fit.empty()) return false;
  if (next.values.empty()) {
    warnings.push_back("--fit " + settings.fit +
                       ": not written; the photograph names nothing of a workshop");
    return false;
  }
  try {
    write_workshop(next, settings.workshop_text, settings.photos.front(), settings.fit);
    files.emplace_back(settings.fit);
    return true;
  } catch (const InputError& error) {
    warnings.push_back("--fit " + settings.fit + ": not written; " + error.what());
    return false;
  }
}

/// What to do now.
std::vector<std::string> notes_of(const CheckSettings& settings, const NextLens& next,
                                  bool fitted) {
  std::vector<std::string> notes{"look at " +
                                 (fs::path(settings.out) / check_file::kReport).string()};
  std::string options = words_of(next.options);
  if (fitted) options = with_word(options, "--made-by ", " ") + shell_word(settings.fit);
  if (!options.empty()) notes.push_back("next lens: lensforge design PICTURE " + options);
  return notes;
}

/// @throw InputError if the file must not be replaced, or what a check needs is given.
CommandResult write_chart(CommandFrame& frame, const CheckSettings& settings) {
  if (!settings.source.empty()) {
    throw InputError("LENS " + settings.source + ": --chart writes a chart and checks nothing");
  }
  if (!settings.lamp.photo.empty()) {
    throw InputError("--lamp-from " + settings.lamp.photo +
                     ": --chart writes a chart and measures nothing");
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

/// @throw InputError if something that a check needs is missing.
void require_given(const char* name, bool given) {
  if (!given) {
    throw InputError(std::string(name) + " is required; lensforge check --help lists the options");
  }
}

/// The part of --lamp-from. @throw InputError
LampTask lamp_task(const CheckSettings& settings) {
  if (!settings.photos.empty()) {
    throw InputError("PHOTO " + settings.photos.front() + ": --lamp-from takes one photograph, " +
                     settings.lamp.photo + "; leave the other out");
  }
  if (!settings.fit.empty()) {
    throw InputError("--fit " + settings.fit + ": --lamp-from learns nothing of a workshop");
  }
  if (settings.source.empty() && !settings.workshop.empty()) {
    throw InputError("--workshop " + settings.workshop + ": is of a part; a pinhole has none");
  }
  return {settings.lamp, settings.source, settings.dark,
          settings.out,  settings.force,  settings.cam};
}

CommandResult run(CommandFrame& frame, CheckSettings& settings) {
  if (!settings.chart.empty()) return write_chart(frame, settings);
  require_given("--out", !settings.out.empty());
  read_shop(settings);
  if (!settings.lamp.photo.empty()) return measure_lamp(frame, lamp_task(settings));
  require_task(LampTask{settings.lamp, settings.source, "", "", false, {}});
  require_given("LENS", !settings.source.empty());
  require_given("PHOTO", !settings.photos.empty());
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
  const bool fitted = write_fit(settings, result.next, files, warnings);
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
  return {json, text, kDone, warnings, notes_of(settings, result.next, fitted)};
}

Command<CheckSettings> check_verb() {
  return {"check", "Finds a lens's picture in a photograph of the wall and says what went wrong.",
          run};
}

}  // namespace

int check_command(const Arguments& arguments) { return run_command(check_verb(), arguments); }

CommandCall check_call() { return call_of(check_verb(), CheckSettings()); }

}  // namespace lensforge::app
