// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/cam_command.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "cam/cam.h"
#include "cam/job/job_files.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/finishing.h"
#include "cam/report/report_data.h"
#include "cam/report/verdict.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/schema/description.h"
#include "core/schema/toml_document.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "machine/gcode.h"

namespace lensforge::app {
namespace fs = std::filesystem;

std::string folder_name(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

void describe(Description& d, CamSettings& settings) {
  d.text("DIR", settings.source, "", "lens folder; --show-workshop needs none");
  d.text("--workshop", settings.workshop, "FILE.toml",
         "machine, blank, clamps, tools and process; options given here win")
      .essential = true;
  d.flag("--show-workshop", settings.show_workshop, "print the workshop in use as TOML and exit")
      .essential = true;
  d.texts("--compare", settings.compare, "KEY=VALUE,…",
          "rank choices by leakage and hours instead of making programs: tool=0.3,0.4 "
          "pitch=0.04,0.06 slope=3e-5,6e-5 large=0,4 (finishing only); mae=0.004 recommends the "
          "quickest that reaches it")
      .essential = true;
  describe(d, settings.cam);
}

void take_workshop(OptionSet& options, const std::string& file, CamOptions& cam) {
  if (file.empty()) return;
  cam.workshop = read_workshop(file);
  cam.post = post_of(cam.workshop, file);
  options.restate();
}

void check_workshop(const std::string& file, const CamOptions& cam) {
  // The file's own values were already checked: any error now comes from an option.
  validate(cam.workshop, (file.empty() ? "workshop" : file) + " with the options given");
}

void settle(OptionSet& options, CamSettings& settings) {
  take_workshop(options, settings.workshop, settings.cam);
  if (!settings.source.empty()) {
    settings.cam.job = folder_name(settings.source);
    const bool front = settings.cam.face == CutFace::kFront;
    settings.cam.other_cut =
        fs::path(settings.source) / (front ? lens_file::kCut : lens_file::kFrontCut);
  }
  check_workshop(settings.workshop, settings.cam);
}

nlohmann::json job_json(const OptionSet& options, const JobResult& result,
                        const std::vector<std::string>& warnings) {
  nlohmann::json json = {{"status", result.done() ? "done" : "interrupted"},
                         {"message", result.message},
                         {"warnings", warnings},
                         {"options", options.used()},
                         {"files", nlohmann::json::array()}};
  for (const fs::path& file : result.files) json["files"].push_back(file.string());
  return json;
}

std::string z_text(double z_offset) { return "  Z         " + z_words(z_offset) + "\n"; }

std::string next_step(const fs::path& page, const JobResult& job, const CamOptions& cam,
                      int missed) {
  std::string note = "look at " + page.string();
  if (missed > 0 || job.files.empty()) return note;
  const std::string& dialect = cam.post.reader.name;
  const bool sendable = dialect == grbl_dialect().name || dialect == grblhal_dialect().name;
  const std::string program = shell_word(job.files.front().string());
  if (!sendable) {
    return joined({note, "; then run ", program, " first, on a machine with ", dialect,
                   " (--post grbl makes programs for lensforge send)"});
  }
  note += "; then: lensforge send " + program + " --dry-run";
  // Without the option send reads programs for Grbl.
  if (dialect != grbl_dialect().name) note += " --dialect " + dialect;
  return note;
}

namespace {

std::string check_text(const LimitCheck& check) {
  const std::string unit = check.unit.empty() ? "" : " " + check.unit;
  return (check.missed() ? "  limit missed: " : "  advice: ") + check.name + " " +
         fixed(check.value, check.decimals) + unit + ", at most " +
         fixed(check.limit, check.decimals) + unit + "\n";
}

}  // namespace

std::string verdict_text(const Verdict& verdict) {
  std::string text;
  for (const LimitCheck& check : verdict.checks) {
    if (!check.passes()) text += check_text(check);
  }
  return text;
}

namespace {

std::string operation_text(const ReportOperation& operation) {
  return "  " + operation.summary.name +
         std::string(10 - std::min<std::size_t>(9, operation.summary.name.size()), ' ') +
         operation.file + ", " + std::to_string(operation.lines) + " moves, " +
         fixed(operation.minutes, 1) + " min\n";
}

std::string surface_text(const RenderedSurface& surface) {
  return "  " + surface.name + "   " + metrics_text(surface.quality.metrics) + ", leaks " +
         fixed(100.0 * surface.quality.leakage, 2) + " %\n";
}

/// The same by waves, and by what the part is judged.
std::string wave_text(const ReportData& report) {
  std::string text = "  " + report.judged_words() + "\n";
  const auto add = [&text](RenderedSurface surface) {
    surface.name += ", by waves";
    text += surface_text(surface);
  };
  if (!report.waves) return text;
  add(report.waves->result.designed);
  for (const RenderedSurface& part : report.waves->result.others) add(part);
  return text;
}

/// The same on the second screen of a lens for two pictures, and which faces are as made.
std::string two_face_text(const ReportData& report) {
  std::string text;
  if (report.second) {
    for (RenderedSurface surface : {report.second->designed, report.second->part()}) {
      surface.name += ", on the second screen";
      text += surface_text(surface);
    }
  }
  return report.face_words.empty() ? text : text + "  " + report.face_words + "\n";
}

std::string summary_text(const fs::path& folder, const CamResult& result) {
  const ReportData& report = result.report;
  std::string text = folder.string() + ": " + result.message + "\n";
  for (const ReportOperation& operation : report.operations) text += operation_text(operation);
  text += "  in all    " + fixed(report.minutes(), 1) + " min\n";
  if (!report.leakage.steps.empty()) {
    text += surface_text(report.leakage.designed);
    for (const RenderedSurface& surface : report.leakage.others) text += surface_text(surface);
    text += wave_text(report) + two_face_text(report);
    if (report.places_matter()) {
      for (const LeakPlace& place : report.places) text += "  " + leak_words(place) + "\n";
    }
    if (!report.tolerances.empty()) text += "  " + report.range_words() + "\n";
    if (!report.faces.empty()) text += "  " + face_error_words(report.faces) + "\n";
  }
  text += verdict_text(report.verdict);
  return report.front ? text : text + z_text(report.z_offset);
}

CommandResult cut(CommandFrame& frame, const CamSettings& settings, const Lens& lens) {
  const CamOptions& cam = settings.cam;
  const OptionSet& options = frame.options();
  const WorkEstimate estimate = estimate_cut(cam, lens, options.executor().concurrency());
  require_room_for_cut(cam, lens.setup, estimate, settings.folder());
  frame.begin_folder(settings.folder()).remove_partial_files(is_name_of_cut);
  announce_work(estimate, frame.console(), "the cut takes");
  if (const std::string few = decimals_warning(cam); !few.empty()) frame.console().note(few);
  const CamResult result =
      make_cut(lens, cam, settings.folder(), frame.executor(), frame.control());
  nlohmann::json json = job_json(options, result, result.report.warnings);
  if (result.done()) json["report"] = report_json(result.report);
  const int missed = result.report.verdict.missed();
  CommandResult outcome{
      json, result.done() ? summary_text(settings.folder(), result) : result.message + "\n",
      exit_code(result.done(), missed == 0), result.report.warnings};
  if (result.done()) {
    outcome.notes.push_back(next_step(settings.folder() / cam_file::kPage, result, cam, missed));
  }
  return outcome;
}

std::string choice_text(const ReportChoice& choice) {
  return "  " + choice.choice + "   leaks " + fixed(100.0 * choice.leakage, 2) + " %, dark " +
         fixed(100.0 * choice.dark_flux, 2) + " %, MAE " + fixed(choice.mae, 4) + ", " +
         fixed(choice.hours, 2) + " h\n";
}

CommandResult compare(CommandFrame& frame, const CamSettings& settings, const Lens& lens) {
  const CutChoices choices = parse_choices(settings.compare, "--compare");
  const OptionSet& options = frame.options();
  const WorkEstimate estimate = require_room_for_comparison(
      lens, settings.cam, choices, settings.folder(), options.executor().concurrency());
  frame.begin_folder(settings.folder()).remove_partial_files(is_name_of_cut);
  announce_work(estimate, frame.console(), "the comparison takes");
  const CutComparison result = compare_cuts(lens, settings.cam, choices, settings.folder(),
                                            frame.executor(), frame.control());
  nlohmann::json json = {{"status", result.complete ? "done" : "interrupted"},
                         {"options", options.used()},
                         {"choices", nlohmann::json::array()},
                         {"files", nlohmann::json::array()}};
  std::string text = result.complete ? "finishing, least leakage first:\n" : "interrupted\n";
  for (const ReportChoice& choice : result.ranking) {
    json["choices"].push_back(choice_json(choice));
    text += choice_text(choice);
  }
  if (!result.advice.empty()) {
    json["advice"] = result.advice;
    text += result.advice + "\n";
  }
  if (result.complete) json["files"].push_back(result.page.string());
  CommandResult outcome{json, text, exit_code(result.complete)};
  if (result.complete) outcome.notes.push_back("look at " + result.page.string());
  return outcome;
}

nlohmann::json workshop_json(const Workshop& workshop) {
  std::ostringstream text;
  text << toml::json_formatter{parse_toml(workshop_toml(workshop), "workshop")};
  return {{"workshop", nlohmann::json::parse(text.str())}};
}

CommandResult run(CommandFrame& frame, CamSettings& settings) {
  const CamOptions& cam = settings.cam;
  if (settings.show_workshop) {
    settle(frame.options(), settings);
    return {workshop_json(cam.workshop), workshop_toml(cam.workshop)};
  }
  if (settings.source.empty()) {
    throw InputError("DIR: is missing; name the lens folder, as in lensforge cam portrait");
  }
  std::optional<FolderLock> reading;
  if (is_folder(settings.source)) {
    reading.emplace(settings.source, FolderLock::Kind::kShared);
  }
  const Lens lens = read_lens(settings.source);
  settle(frame.options(), settings);
  validate(cam, lens.setup);
  note_unfinished_design(lens, frame.console());
  return settings.compare.empty() ? cut(frame, settings, lens) : compare(frame, settings, lens);
}

}  // namespace

int cam_command(const Arguments& arguments) {
  return run_command<CamSettings>(
      {"cam", "Makes the programs that mill a lens and predicts what it will project.", run,
       "lensforge cam lens --workshop mine.toml --post grbl"},
      arguments);
}

// Several lenses on one blank: `nest`.

namespace {

constexpr const char* kBlank = "--blank";

/// A gap beyond it is none, mm.
constexpr double kWidestGap = 1000.0;

std::string blank_text(const NestOptions& options) {
  std::vector<double> numbers(options.blank.data(), options.blank.data() + 2);
  if (options.thickness) numbers.push_back(*options.thickness);
  return options.blank.isZero() ? "" : numbers_text(numbers);
}

void set_blank(NestOptions& options, const std::string& text) {
  const auto commas = std::count(text.begin(), text.end(), ',');
  const std::vector<double> numbers = parse_numbers(text, kBlank, commas == 2 ? 3 : 2);
  options.blank = {numbers[0], numbers[1]};
  options.thickness.reset();
  if (numbers.size() > 2) options.thickness = numbers[2];
}

void describe_sheet(Description& d, NestOptions& options) {
  d.text(
      {.name = kBlank,
       .help = "width and height of the common blank, and its thickness where it is more than "
               "the highest lens needs, mm",
       .unit = "W,H[,T]"},
      [&options] { return blank_text(options); },
      [&options](const std::string& text) { set_blank(options, text); });
  d.length("--gap", options.gap, Limits::between(0, kWidestGap),
           "between lenses, at least; 0: the least that the tools need");
}

}  // namespace

void describe(Description& d, NestSettings& settings) {
  d.texts("DIR", settings.sources, "", "lens folders; one named twice is cut twice");
  d.text("--out", settings.out, "DIR",
         "folder for programs, layout and a folder of reports of each lens")
      .needed = true;
  describe_sheet(d, settings.nest);
  d.text("--workshop", settings.workshop, "FILE.toml",
         "machine, blank, clamps, tools and process; options given here win");
  describe(d, settings.nest.cam);
}

void settle(OptionSet& options, NestSettings& settings) {
  take_workshop(options, settings.workshop, settings.nest.cam);
  if (settings.sources.empty()) {
    throw InputError("DIR: is required; name the lens folders, such as nest bee disc");
  }
  if (!options.given(kBlank)) throw InputError("--blank: is required; such as --blank 300,200");
  settings.nest.cam.job = folder_name(settings.out);
  check_workshop(settings.workshop, settings.nest.cam);
}

std::vector<std::string> nest_names(const std::vector<std::string>& sources) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& source : sources) {
    const std::string name = folder_name(source);
    std::string unique = name;
    for (int number = 2; !taken.insert(unique).second; ++number) {
      unique = name;
      unique.append("_").append(std::to_string(number));
    }
    names.push_back(unique);
  }
  return names;
}

namespace {

/// Every folder once, however often it is named; none is written to while the nest is made.
class Sources {
 public:
  explicit Sources(const NestSettings& settings) : names_(nest_names(settings.sources)) {
    for (const std::string& source : settings.sources) {
      if (is_folder(source) && !lenses_.contains(source)) {
        locks_.emplace_back(source, FolderLock::Kind::kShared);
      }
      if (!lenses_.contains(source)) lenses_.emplace(source, read_lens(source));
      order_.push_back(source);
    }
  }

  [[nodiscard]] std::vector<NestLens> lenses() const {
    std::vector<NestLens> all;
    for (std::size_t k = 0; k < order_.size(); ++k) {
      all.push_back({names_[k], &lenses_.at(order_[k])});
    }
    return all;
  }
  [[nodiscard]] const std::string& folder(std::size_t k) const { return order_[k]; }
  void note_unfinished(const Console& console) const {
    for (const auto& [source, lens] : lenses_) note_unfinished_design(lens, console);
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::string> order_;
  std::vector<FolderLock> locks_;
  std::map<std::string, Lens> lenses_;
};

std::string place_text(const NestedLens& lens) {
  const Eigen::Vector2d at = lens.box.min();
  std::string text =
      "  " + lens.name + " at X " + trimmed_decimal(at.x(), 2) + " Y " + trimmed_decimal(at.y(), 2);
  if (!lens.report.leakage.steps.empty()) {
    const PictureQuality& part = lens.report.judged().part().quality;
    text += ": " + metrics_text(part.metrics) + ", leaks " + fixed(100.0 * part.leakage, 2) + " %";
  }
  return text + (lens.cut_out ? "\n" : ", stays joined\n");
}

std::string summary_text(const fs::path& folder, const NestResult& result) {
  if (!result.done()) return result.message + "\n";
  const NestLayout& layout = result.layout;
  std::string text = folder.string() + ": " + result.message + "\n  blank     " +
                     trimmed_decimal(layout.blank.x(), 2) + " x " +
                     trimmed_decimal(layout.blank.y(), 2) + " x " +
                     trimmed_decimal(layout.blank.z(), 3) +
                     " mm, X0 Y0 in its lower left corner; lenses at least " +
                     trimmed_decimal(layout.gap, 2) + " mm apart\n";
  for (const NestedLens& lens : layout.lenses) {
    text += place_text(lens) + verdict_text(lens.report.verdict);
  }
  for (const NestProgram& program : result.programs) {
    text += "  " + program.file + ", " + std::to_string(program.lines) + " moves, " +
            fixed(program.minutes, 1) + " min\n";
  }
  return text + "  in all    " + fixed(result.minutes(), 1) + " min, " +
         std::to_string(result.tool_changes) + " tools put in\n" + z_text(result.z_offset);
}

nlohmann::json summary_json(const OptionSet& options, const NestResult& result,
                            const Sources& sources) {
  nlohmann::json json = job_json(options, result, result.warnings);
  if (!result.done()) return json;
  json.update(nest_json(result, true));
  for (std::size_t k = 0; k < json["lenses"].size(); ++k) {
    json["lenses"][k]["folder"] = sources.folder(k);
  }
  return json;
}

/// Warnings that are in every lens's report, such as collisions on the common blank, only once.
std::vector<std::string> warnings_of(const NestResult& result) {
  std::vector<std::string> warnings = result.warnings;
  const std::vector<NestedLens>& lenses = result.layout.lenses;
  for (const NestedLens& lens : lenses) {
    for (const std::string& warning : lens.report.warnings) {
      const bool common = std::all_of(lenses.begin(), lenses.end(), [&](const NestedLens& other) {
        const std::vector<std::string>& all = other.report.warnings;
        return std::find(all.begin(), all.end(), warning) != all.end();
      });
      if (!common) warnings.push_back(lens.name + ": " + warning);
      if (common && &lens == &lenses.front()) warnings.push_back(warning);
    }
  }
  return warnings;
}

CommandResult run(CommandFrame& frame, NestSettings& settings) {
  OptionSet& options = frame.options();
  settle(options, settings);
  const Sources sources(settings);
  const std::vector<NestLens> lenses = sources.lenses();
  sources.note_unfinished(frame.console());
  const NestPlan plan = plan_nest(lenses, settings.nest);
  require_no_lens_folder(lenses, settings.out);
  const WorkEstimate estimate = estimate_nest(plan, lenses, options.executor().concurrency());
  require_room_for_cut(plan.cuts.front(), lenses.front().lens->setup, estimate, settings.out);
  frame.begin_folder(settings.out).remove_partial_files(is_name_of_nest);
  announce_work(estimate, frame.console(), "the cuts take");
  const NestResult result =
      make_nest(lenses, settings.nest, settings.out, frame.executor(), frame.control());
  CommandResult outcome{summary_json(options, result, sources), summary_text(settings.out, result),
                        exit_code(result.done(), result.missed() == 0), warnings_of(result)};
  if (result.done()) {
    outcome.notes.push_back(next_step(fs::path(settings.out) / nest_file::kLayout, result,
                                      settings.nest.cam, result.missed()));
  }
  return outcome;
}

Command<NestSettings> nest_verb() {
  return {
      "nest",
      "Makes programs that mill several lenses of one blank with one zero, and predicts what each "
      "will project.",
      run};
}

}  // namespace

int nest_command(const Arguments& arguments) { return run_command(nest_verb(), arguments); }

CommandCall nest_call() { return call_of(nest_verb(), NestSettings()); }

}  // namespace lensforge::app
