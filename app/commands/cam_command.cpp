// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/cam_command.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>

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
  if (!settings.source.empty()) settings.cam.job = folder_name(settings.source);
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

std::string summary_text(const fs::path& folder, const CamResult& result) {
  const ReportData& report = result.report;
  std::string text = folder.string() + ": " + result.message + "\n";
  for (const ReportOperation& operation : report.operations) text += operation_text(operation);
  text += "  in all    " + fixed(report.minutes(), 1) + " min\n";
  if (!report.leakage.steps.empty()) {
    text += surface_text(report.leakage.designed);
    for (const RenderedSurface& surface : report.leakage.others) text += surface_text(surface);
    text += wave_text(report);
    if (report.places_matter()) {
      for (const LeakPlace& place : report.places) text += "  " + leak_words(place) + "\n";
    }
    if (!report.tolerances.empty()) text += "  " + report.range_words() + "\n";
  }
  return text + verdict_text(report.verdict) + z_text(report.z_offset);
}

CommandResult cut(CommandFrame& frame, const CamSettings& settings, const Lens& lens) {
  const CamOptions& cam = settings.cam;
  const OptionSet& options = frame.options();
  const WorkEstimate estimate = estimate_cut(cam, lens.setup, options.executor().concurrency());
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

}  // namespace lensforge::app
