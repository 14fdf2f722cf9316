// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/lamp_command.h"

#include <filesystem>
#include <vector>

#include "app/frame/common_output.h"
#include "cam/check/check_job.h"
#include "cam/check/wall_model.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/lens/lens.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr double kMrad = 1e3;

/// A measured width, to a hundredth.
std::string measured_text(double value) { return number_text(to_digits(value, 0.01 * value)); }

}  // namespace

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

namespace {

/// Options of a pinhole alone, and whether they are given.
std::vector<std::pair<const char*, bool>> pinhole_options(const LampFrom& lamp) {
  return {{"--pinhole-distance", lamp.pinhole.distance > 0.0},
          {"--photo-width", lamp.pinhole.photo_width > 0.0},
          {"--pinhole-diameter", lamp.diameter > 0.0},
          {"--lamp-distance", lamp.distance > 0.0}};
}

}  // namespace

void validate(const LampTask& task) {
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

namespace {

/// "9.3 mrad" or "3 mm".
std::string width_words(double width, bool is_size) {
  return is_size ? measured_text(width) + " mm" : measured_text(kMrad * width) + " mrad";
}

/// How wide the hole makes the image of a point, as an angle from the hole.
std::string blur_words(const LampFrom& lamp) {
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

}  // namespace

CommandResult measure_lamp(CommandFrame& frame, const LampTask& task) {
  validate(task);
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
                           blur_words(task.lamp);
  return {json,
          text,
          kDone,
          lamp_warnings(lamp.picture),
          {"next lens: lensforge design PICTURE --source-picture " + shell_word(file.string()) +
           " " + words_of(lamp.options)}};
}

}  // namespace lensforge::app
