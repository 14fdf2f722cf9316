// SPDX-License-Identifier: GPL-3.0-or-later
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
#include "core/page/html_page.h"
#include "core/schema/description.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/setup/design_options.h"

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
  d.word("--part", settings.wish.cut.part, {{"lens", PartKind::kLens}, {"print", PartKind::kPrint}},
         "mill the lens, or print it on the workshop's printer and level it with a film")
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

/// The options of a proposal that differ from those of its lamp and material.
OptionValues options_of(const Proposal& proposal) {
  const std::set<std::string> always{"--width", "--focal", "--pixels"};
  DesignOptions design = proposal.design;
  DesignOptions usual;
  set_lamp(usual.light, design.light.lamp);
  usual.light.lamp.clear();  // It is to be named.
  set_material(design.material, usual.light, usual.ior, usual.light.spectrum.abbe);
  const Description without = known(usual);
  OptionValues values;
  for (const Field& field : known(design)) {
    if (!always.contains(field.name) && field.get() == without.at(field.name).get()) continue;
    values[field.name] = field.get();
  }
  return values;
}

std::string typed(const OptionValues& values) {
  std::string text;
  for (const auto& [name, value] : values) text += " " + name + " " + shell_word(value_text(value));
  return text;
}

nlohmann::json values_json(const OptionValues& values) {
  nlohmann::json object = nlohmann::json::object();
  for (const auto& [name, value] : values) object[name] = lensforge::json_of(value);
  return object;
}

struct Commands {
  std::string design;
  std::string make;
};

Commands commands_of(const Proposal& proposal, const PlanSettings& settings) {
  const std::string design =
      "lensforge design " + shell_word(settings.target) + typed(options_of(proposal));
  const std::string shop = shell_word(settings.made_by);
  if (settings.wish.printed()) {
    return {design + " --made-by " + shop + " --part print --out lens",
            "lensforge export lens --out lens.stl"};
  }
  const bool own = settings.made_by != "default";
  return {design + " --out lens",
          std::string("lensforge cam lens") + (own ? " --workshop " + shop : "")};
}

nlohmann::json print_json(const PrintForecast& print) {
  const Eigen::Vector3d& box = print.run.box;
  return {{"box_mm", {box.x(), box.y(), box.z()}},
          {"layers", print.run.layers},
          {"steps_mae", print.steps_mae},
          {"terrace_mm", print.terraces.width},
          {"terrace_share", print.terraces.share}};
}

nlohmann::json proposal_json(const Proposal& proposal, const PlanSettings& settings) {
  const ProposalForecast& f = proposal.forecast;
  nlohmann::json operations = nlohmann::json::array();
  for (const OperationMinutes& one : f.operations) {
    operations.push_back({{"name", one.name}, {"minutes", one.minutes}});
  }
  const Commands commands = commands_of(proposal, settings);
  const DesignOptions& design = proposal.design;
  nlohmann::json json = {{"title", proposal.title},
                         {"words", proposal.words},
                         {"width_mm", design.width},
                         {"focal_mm", design.focal_length},
                         {"image_width_mm", picture_width(design)},
                         {"pixels", design.pixels},
                         {"sharp_pixels", f.sharp_pixels},
                         {"blur", blurs_json(f.blurs)},
                         {"light_model", f.waves ? "waves" : "rays"},
                         {"mae", f.mae},
                         {"leakage", f.leakage},
                         {"contrast", f.contrast},
                         {"relief_mm", f.relief},
                         {"sheet_mm", f.sheet > 0.0 ? nlohmann::json(f.sheet) : nlohmann::json()},
                         {"operations", operations},
                         {"minutes", f.minutes()},
                         {"design_seconds", f.design_seconds},
                         {"options", values_json(options_of(proposal))},
                         {"commands", {commands.design, commands.make}}};
  if (f.print) json["print"] = print_json(*f.print);
  return json;
}

/// A length that may be far below a millimetre: three digits.
std::string short_length(double mm) { return number_text(mm, 3) + " mm"; }

/// More of a lens than this shows steps, not the picture.
constexpr double kMostTerraces = 0.5;

/// What the print's steps do to the picture, and what it takes that they do not.
std::string steps_text(const Proposal& proposal, const Printer& printer) {
  const ProposalForecast& f = proposal.forecast;
  const Terraces& terraces = f.print->terraces;
  const double spread = f.blurs.back().pixels;  // print_blurs() ends with the steps.
  if (terraces.share == 0.0) return "\n  steps     the film levels them within a pixel";
  std::string text = terraces.share > kMostTerraces
                         ? "\n  steps     this print does not show the picture: terraces"
                         : "\n  steps     terraces";
  text += " wider than " + short_length(terraces.width) + ", on " + percent_text(terraces.share) +
          " of the lens, stay under the film and spread light over up to " + fixed(spread, 1) +
          " pixels, which is " + fixed(f.print->steps_mae, 4) + " of the MAE; ";
  text += (printer.upright ? "pixels of " : "layers of ") + short_length(printer.step() / spread);
  const double wall = proposal.design.focal_length / spread;
  if (wall >= proposal.design.width) text += " or a wall at " + short_length(wall);
  return text + " would keep that within a pixel";
}

std::string print_text(const Proposal& proposal, const Printer& printer) {
  const PrintRun& run = proposal.forecast.print->run;
  return "\n  print     relief " + fixed(proposal.forecast.relief, 1) + " mm on " +
         number_text(proposal.design.thickness) + " mm: " + std::to_string(run.layers) +
         " layers of " + number_text(printer.layer) + " mm, " + fixed(run.box.x(), 0) + " x " +
         fixed(run.box.y(), 0) + " mm on the bed, " + fixed(run.box.z(), 0) + " mm high";
}

std::string blank_text(const Proposal& proposal) {
  const ProposalForecast& f = proposal.forecast;
  return "\n  blank     relief " + fixed(f.relief, 1) + " mm on " +
         number_text(proposal.design.thickness) + " mm: " +
         (f.sheet > 0.0
              ? "a sheet of " + number_text(f.sheet) + " mm"
              : std::string("thicker than every sheet on sale; a farther wall needs less"));
}

std::string text_of(const Proposal& proposal, const PlanSettings& settings) {
  const ProposalForecast& f = proposal.forecast;
  const DesignOptions& design = proposal.design;
  std::string text = capitalised(proposal.title);
  if (!proposal.words.empty()) text += ": " + proposal.words;
  text += "\n  lens      " + number_text(design.width) + " mm wide, wall at " +
          number_text(design.focal_length) + " mm, picture " + number_text(picture_width(design)) +
          " mm wide with " + std::to_string(design.pixels) + " pixels";
  if (design.pixels > f.sharp_pixels) {
    text += "; only " + std::to_string(f.sharp_pixels) + " would be sharp in this light";
  }
  text += "\n  light     " + blur_words(f.blurs) + "; the picture goes by " +
          (f.waves ? "waves" : "rays");
  text += "\n  expect    MAE about " + fixed(f.mae, 4) + ", " + percent_text(f.leakage) +
          " of the light leaks";
  if (f.contrast > 0.0) text += ", contrast " + contrast_text(f.contrast);
  const Printer& printer = settings.wish.cut.workshop.printer;
  text += f.print ? steps_text(proposal, printer) + print_text(proposal, printer)
                  : blank_text(proposal);
  text += "\n  machine   " + duration_text(f.minutes());
  std::string parts;
  for (const OperationMinutes& one : f.operations) {
    parts = with_word(std::move(parts), one.name + " " + duration_text(one.minutes));
  }
  text +=
      " (" + parts + "); the design takes about " + duration_text(f.design_seconds / 60.0) + "\n";
  const Commands commands = commands_of(proposal, settings);
  return text + "    " + commands.design + "\n    " + commands.make + "\n";
}

/// A print is of resin unless another material is stated, and needs no sheet.
void settle_print(const OptionSet& options, PlanSettings& settings) {
  if (options.given("--sheets")) {
    throw InputError("--sheets " + printable_line(settings.sheets) +
                     ": a print needs no sheet; leave it out, or use --part lens");
  }
  DesignOptions& design = settings.wish.design;
  if (!options.given("--material") && !options.given("--ior")) {
    design.material = "resin";
    set_material(design.material, design.light, design.ior, design.light.spectrum.abbe);
  }
}

CommandResult run(CommandFrame& frame, PlanSettings& settings) {
  OptionSet& options = frame.options();
  frame.begin_file();
  ProposalWish& wish = settings.wish;
  wish.sized = options.given("--width");
  wish.pixelled = options.given("--pixels");
  if (options.given("--sheets")) wish.sheets = sheets_of(settings.sheets);
  if (wish.printed()) settle_print(options, settings);
  if (settings.made_by != "default") wish.cut.workshop = read_workshop(settings.made_by);
  const LoadedImage picture =
      read_image(settings.target, frame.control(), kDrawnSide, settings.background);
  for (const std::string& change : picture.changes) {
    frame.console().note(joined({settings.target, ": ", change}));
  }
  read_lamp(wish.design.light, settings.background, frame.control(), frame.console());
  const std::vector<Proposal> proposals =
      propose(picture.image, wish, frame.executor(), frame.control());
  CommandResult result;
  result.json["proposals"] = nlohmann::json::array();
  for (const Proposal& proposal : proposals) {
    result.json["proposals"].push_back(proposal_json(proposal, settings));
    result.text = with_word(std::move(result.text), text_of(proposal, settings), "\n");
  }
  return result;
}

Command<PlanSettings> plan_verb() {
  return {"plan",
          "Proposes sizes for a lens from what is known of picture, lamp, wall and workshop, and "
          "says what to expect of each.",
          run, "lensforge plan portrait.png --lamp led:3mm@600mm --focal 400 --hours 4"};
}

}  // namespace

int plan_command(const Arguments& arguments) { return run_command(plan_verb(), arguments); }

CommandCall plan_call() { return call_of(plan_verb(), PlanSettings()); }

}  // namespace lensforge::app
