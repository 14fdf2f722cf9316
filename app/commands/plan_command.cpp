// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/commands/design_command.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "cam/proposal/proposal.h"
#include "cam/workshop/workshop.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/optics/picture_blur.h"
#include "core/schema/option_text.h"
#include "core/text/number_text.h"
#include "core/text/read_numbers.h"
#include "core/text/words.h"
#include "design/setup/option_tables.h"

namespace lensforge::app {
namespace {

/// Options of `lensforge plan`.
struct PlanSettings {
  std::string target;
  Background background;
  std::string made_by = "default";
  std::string sheets;
  ProposalWish wish;
};

/// What a person knows of a design; the rest is proposed.
const std::set<std::string> kKnown{
    "--lamp",      "--material",     "--width",       "--focal",           "--ior",
    "--pixels",    "--thickness",    "--source",      "--source-position", "--source-distance",
    "--emission",  "--source-angle", "--source-size", "--source-picture",  "--image-width",
    "--wavelength"};

Description known(DesignOptions& design) {
  Description all = description_of(design);
  all.add(description_of(design.light));
  return all.only(kKnown);
}

void describe(Description& d, PlanSettings& settings) {
  d.text("PICTURE", settings.target, "", "picture to project").needed = true;
  d.add(known(settings.wish.design));
  d.text("--made-by", settings.made_by, "default|FILE.toml",
         "the workshop that cuts and polishes the lens")
      .essential = true;
  d.number("--hours", settings.wish.hours, Limits::between(0.1, 1000.0), "h",
           "on the machine at most, where --width is not given")
      .essential = true;
  d.text("--sheets", settings.sheets, "LIST",
         "thicknesses of the sheets on sale, mm; without it 2,3,4,5,6,8,10,12,15,20,25,30")
      .essential = true;
  describe(d, settings.background);
}

/// @throw InputError naming the option unless they are lengths above 0.
std::vector<double> sheets_of(const std::string& text) {
  std::vector<double> sheets;
  for (const std::string_view word : split(text, ',')) {
    const double sheet = parse_length_mm(word, "--sheets");
    if (!(sheet > 0.0 && sheet <= kMaxThickness)) {
      throw InputError("--sheets " + printable_line(text) + ": each must be above 0, at most " +
                       number_text(kMaxThickness) + " mm; 5,8,10 works");
    }
    sheets.push_back(sheet);
  }
  return sheets;
}

std::string percent(double share) { return fixed(100.0 * share, 1) + " %"; }

/// The options of a proposal that differ from a design's defaults, as typed.
std::string options_of(const Proposal& proposal) {
  const Description usual = known(*std::make_unique<DesignOptions>());
  DesignOptions design = proposal.design;
  std::string text;
  const bool lamp = !design.light.lamp.empty();
  for (const Field& field : known(design)) {
    // A lamp and a material stand for these.
    const bool stood_for = (lamp && (field.name.starts_with("--source") ||
                                     field.name == "--emission" || field.name == "--wavelength")) ||
                           (!design.material.empty() && field.name == "--ior");
    const bool size =
        field.name == "--width" || field.name == "--focal" || field.name == "--pixels";
    if (stood_for || (!size && field.get() == usual.at(field.name).get())) continue;
    text += " " + field.name + " " + shell_word(value_text(field.get()));
  }
  return text;
}

struct Commands {
  std::string design;
  std::string cam;
};

Commands commands_of(const Proposal& proposal, const PlanSettings& settings) {
  const bool own = settings.made_by != "default";
  return {"lensforge design " + shell_word(settings.target) + options_of(proposal) + " --out lens",
          std::string("lensforge cam lens") +
              (own ? " --workshop " + shell_word(settings.made_by) : "")};
}

nlohmann::json json_of_blurs(const std::vector<PictureBlur>& blurs) {
  nlohmann::json all = nlohmann::json::array();
  for (const PictureBlur& blur : blurs) {
    all.push_back({{"cause", blur.cause}, {"pixels", blur.pixels}});
  }
  return all;
}

nlohmann::json json_of(const Proposal& proposal, const PlanSettings& settings) {
  const ProposalForecast& f = proposal.forecast;
  nlohmann::json operations = nlohmann::json::array();
  for (const OperationMinutes& one : f.operations) {
    operations.push_back({{"name", one.name}, {"minutes", one.minutes}});
  }
  const Commands commands = commands_of(proposal, settings);
  const DesignOptions& design = proposal.design;
  return {
      {"title", proposal.title},
      {"words", proposal.words},
      {"width_mm", design.width},
      {"focal_mm", design.focal_length},
      {"image_width_mm", design.light.image_width > 0.0 ? design.light.image_width : design.width},
      {"pixels", design.pixels},
      {"sharp_pixels", f.sharp_pixels},
      {"blur", json_of_blurs(f.blurs)},
      {"light_model", f.waves ? "waves" : "rays"},
      {"mae", f.mae},
      {"leakage", f.leakage},
      {"contrast", f.contrast},
      {"relief_mm", f.relief},
      {"sheet_mm", f.sheet > 0.0 ? nlohmann::json(f.sheet) : nlohmann::json()},
      {"operations", operations},
      {"minutes", f.minutes()},
      {"design_seconds", f.design_seconds},
      {"commands", {commands.design, commands.cam}}};
}

std::string hours_text(double minutes) {
  constexpr double kMinutesPerHour = 60.0;
  constexpr double kSecondsPerMinute = 60.0;
  if (minutes < 2.0) return fixed(kSecondsPerMinute * minutes, 0) + " s";
  if (minutes < 1.5 * kMinutesPerHour) return fixed(minutes, 0) + " min";
  return fixed(minutes / kMinutesPerHour, 1) + " h";
}

std::string text_of(const Proposal& proposal, const PlanSettings& settings) {
  const ProposalForecast& f = proposal.forecast;
  const DesignOptions& design = proposal.design;
  const double image = design.light.image_width > 0.0 ? design.light.image_width : design.width;
  std::string text = capitalised(proposal.title);
  if (!proposal.words.empty()) text += ": " + proposal.words;
  text += "\n  lens      " + number_text(design.width) + " mm wide, wall at " +
          number_text(design.focal_length) + " mm, picture " + number_text(image) +
          " mm wide with " + std::to_string(design.pixels) + " pixels";
  if (design.pixels > f.sharp_pixels) {
    text += "; only " + std::to_string(f.sharp_pixels) + " would be sharp in this light";
  }
  text += "\n  light     " + blur_words(f.blurs) + "; the picture goes by " +
          (f.waves ? "waves" : "rays");
  text += "\n  expect    MAE about " + fixed(f.mae, 4) + ", " + percent(f.leakage) +
          " of the light leaks";
  if (f.contrast > 0.0) text += ", contrast " + fixed(f.contrast, 0) + " : 1";
  text += "\n  blank     relief " + fixed(f.relief, 1) + " mm on " + number_text(design.thickness) +
          " mm: ";
  text += f.sheet > 0.0
              ? "a sheet of " + number_text(f.sheet) + " mm"
              : std::string("thicker than every sheet on sale; a farther wall needs less");
  text += "\n  machine   " + hours_text(f.minutes());
  std::string parts;
  for (const OperationMinutes& one : f.operations) {
    parts = with_word(std::move(parts), one.name + " " + hours_text(one.minutes));
  }
  text += " (" + parts + "); the design takes about " + hours_text(f.design_seconds / 60.0) + "\n";
  const Commands commands = commands_of(proposal, settings);
  return text + "    " + commands.design + "\n    " + commands.cam + "\n";
}

CommandResult run(CommandFrame& frame, PlanSettings& settings) {
  OptionSet& options = frame.options();
  frame.begin();
  ProposalWish& wish = settings.wish;
  wish.sized = options.given("--width");
  wish.pixelled = options.given("--pixels");
  if (options.given("--sheets")) wish.sheets = sheets_of(settings.sheets);
  if (settings.made_by != "default") wish.cut.workshop = read_workshop(settings.made_by);
  const LoadedImage picture =
      read_image(settings.target, frame.control(), kDrawnSide, settings.background);
  for (const std::string& change : picture.changes) {
    frame.console().note(joined({settings.target, ": ", change}));
  }
  LightOptions& light = wish.design.light;
  if (!light.source_picture.empty()) {
    light.source_shape = shape_of(
        read_image(light.source_picture, frame.control(), kDrawnSide, settings.background).image);
  }
  const std::vector<Proposal> proposals =
      propose(picture.image, wish, frame.executor(), frame.control());
  CommandResult result;
  result.json["proposals"] = nlohmann::json::array();
  for (const Proposal& proposal : proposals) {
    result.json["proposals"].push_back(json_of(proposal, settings));
    result.text = with_word(std::move(result.text), text_of(proposal, settings), "\n");
  }
  return result;
}

Command<PlanSettings> command() {
  return {"plan",
          "Proposes sizes for a lens from what is known of picture, lamp, wall and workshop, and "
          "says what to expect of each.",
          run, "lensforge plan portrait.png --lamp led:3mm@600mm --focal 400 --hours 4"};
}

}  // namespace

int plan_command(const Arguments& arguments) { return run_command(command(), arguments); }

CommandCall plan_call() { return call_of(command(), PlanSettings()); }

}  // namespace lensforge::app
