// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/lamp_command.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "cam/check/check_job.h"
#include "cam/check/wall_view.h"
#include "core/error.h"
#include "core/image/image_io.h"
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
  bool force = false;
  LampFrom lamp;
  CamOptions cam;
};

void describe(Description& d, CheckSettings& settings) {
  d.text("LENS", settings.source, "", "lens folder");
  d.texts("PHOTO", settings.photos, "",
          "photograph of the wall; several of the same view with different exposures count as one");
  d.text("--out", settings.out, "DIR", "folder for report, pictures and check.json").needed = true;
  d.text("--dark", settings.dark, "PHOTO",
         "the same view and exposure with the lamp off: the room's light, which is subtracted");
  d.text("--workshop", settings.workshop, "FILE.toml",
         "the workshop that made the part; without it the default one");
  d.text("--fit", settings.fit, "FILE.toml",
         "write the workshop with what the photograph tells of it, polish.sigma or "
         "finish.pitch_error, for design --made-by and cam --workshop");
  describe(d, settings.lamp);
  d.flag("--force", settings.force, "replace files that lensforge did not write");
}

Photograph read_photo(const std::string& file, const Image& dark, CommandFrame& frame) {
  return photograph(read_image(file, frame.control()).image, dark, file);
}

/// @throw InputError as bracketed().
Photograph read_photos(const CheckSettings& settings, CommandFrame& frame) {
  if (settings.photos.size() > 1 && !settings.dark.empty()) {
    throw InputError("--dark " + settings.dark +
                     ": belongs to one exposure; give one PHOTO, or leave it out");
  }
  Image dark;
  if (!settings.dark.empty()) dark = read_image(settings.dark, frame.control()).image;
  if (settings.photos.size() == 1) return read_photo(settings.photos.front(), dark, frame);
  std::vector<Photograph> exposures;
  for (const std::string& file : settings.photos) {
    exposures.push_back(read_photo(file, {}, frame));
  }
  return bracketed(exposures);
}

std::vector<std::string> warnings_of(const Lens& lens, const CheckResult& result) {
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

/// @throw InputError
void require_photos(const CheckSettings& settings) {
  const std::string rest = " is required; lensforge check --help lists the options";
  if (settings.source.empty()) throw InputError("LENS" + rest);
  if (settings.photos.empty()) throw InputError("PHOTO" + rest);
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
  read_shop(settings);
  if (!settings.lamp.photo.empty()) return measure_lamp(frame, lamp_task(settings));
  validate(LampTask{settings.lamp, settings.source, "", "", false, {}});
  require_photos(settings);
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
  std::vector<std::string> warnings = warnings_of(lens, result);
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

Command<CheckSettings> command() {
  return {"check", "Finds a lens's picture in a photograph of the wall and says what went wrong.",
          run};
}

}  // namespace

int check_command(const Arguments& arguments) { return run_command(command(), arguments); }

CommandCall check_call() { return call_of(command(), CheckSettings()); }

}  // namespace lensforge::app
