// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "app/commands/settings.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/mesh/mesh_files.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "design/reflect.h"
#include "design/reflect/glare.h"
#include "design/reflect/radar.h"
#include "design/reflect/radar_goal.h"
#include "export/solid/solid_files.h"
#include "export/solid/solid_reading.h"

namespace lensforge::app {

void describe(Description& d, ReflectSettings& settings) {
  d.text("MESH", settings.mesh, "", "shape: .stl, .obj, .ply, .off; solid: .step, .stp; z is up")
      .needed = true;
  d.text("--out", settings.out, "DIR", "folder for the new shape, its pictures and figures");
  d.flag("--evaluate", settings.evaluate,
         "print the reflected energies of the mesh as it is and write nothing");
  d.flag("--resume", settings.resume,
         "continue the interrupted run in --out, with the same mesh and options");
  d.flag("--step", settings.step,
         "write surface.step, too: every face flat, closed pieces as solids, open ones as shells");
  describe(d, settings.reflect);
}

namespace {

namespace fs = std::filesystem;

/// Nothing is written yet: a remeshing, which does not check the stop token, is abandoned with the
/// process.
reflect::ReflectInput prepared(const ReflectSettings& settings, const RunControl& control) {
  control.report({"reflect, reading the mesh", 0.0, 0.0, ""});
  const SurfaceMesh mesh = is_step_file(settings.mesh) ? read_solid_mesh(settings.mesh, control)
                                                       : read_mesh(settings.mesh);
  control.report({settings.reflect.faces > 0 ? "reflect, remeshing" : "reflect, repairing the mesh",
                  0.0, 0.0, ""});
  reflect::ReflectInput input = reflect::prepared_input(mesh, settings.mesh, settings.reflect);
  if (control.stop_requested()) throw Interrupted();
  return input;
}

reflect::ReflectInput load(CommandFrame& frame, const ReflectSettings& settings) {
  frame.begin_file();
  reflect::ReflectInput input = prepared(settings, frame.control());
  for (const std::string& change : input.changes) {
    frame.console().note(settings.mesh + ": " + change);
  }
  return input;
}

nlohmann::json evaluated(const OptionSet& options, const ReflectSettings& settings,
                         const SurfaceMesh& mesh, const Executor& executor) {
  const reflect::Energies energies = reflect::evaluate(mesh, settings.reflect, executor);
  nlohmann::json json = {{"mesh", settings.mesh},
                         {"options", options.used()},
                         {"energy_direct", energies.direct},
                         {"energy", energies.total}};
  const double ghz = settings.reflect.radar_ghz;
  if (ghz > 0.0) {
    json["radar"] = {{"ghz", ghz},
                     {"polarization", reflect::polarization_word(settings.reflect.polarization)},
                     {"mean_dbsm", reflect::mean_dbsm(
                                       reflect::radar_sections(mesh, settings.reflect, executor))}};
  }
  if (settings.reflect.goal == reflect::GoalKind::kRadar) {
    json["radar"] = {{"ghz", reflect::radar_sector(settings.reflect, mesh).ghz},
                     {"polarization", reflect::polarization_word(settings.reflect.polarization)},
                     {"mean_dbsm", reflect::mean_dbsm({energies.total})}};
  }
  if (!settings.reflect.glare.empty()) {
    const reflect::GlareSetup setup = reflect::make_glare_setup(settings.reflect);
    json["glare"] = reflect::glare_json(setup);
    json["glare"].update(reflect::glare_json(setup, reflect::yearly_glare(mesh, setup, executor)));
  }
  return json;
}

/// "1240 W/m2 (2025-03-08 12:35), 31.5 h a year above 500 W/m2"
/// @param year  reflect::glare_json() of a year. @param setup  the setup's, with the limit.
std::string glare_words(const nlohmann::json& year, const nlohmann::json& setup) {
  std::string text = number_text(year["maximum"], 4) + " W/m2";
  if (year["time"].is_string()) text += " (" + year["time"].get<std::string>() + ")";
  if (setup.contains("limit")) {
    text += ", " + fixed(year["hours_above_limit"], 1) + " h a year above " +
            number_text(setup["limit"], 4) + " W/m2";
  }
  return text;
}

CommandResult evaluate(CommandFrame& frame, const ReflectSettings& settings) {
  const reflect::ReflectInput input = load(frame, settings);
  frame.begin_file();
  frame.control().report({"reflect, evaluating", 0.0, 0.0, ""});
  const nlohmann::json json = evaluated(frame.options(), settings, input.mesh, frame.executor());
  std::string text = settings.mesh + "\n  energy of one reflection " +
                     number_text(json["energy_direct"]) + ", of one and two " +
                     number_text(json["energy"]) + "\n";
  if (json.contains("radar")) {
    text += "  radar cross-section on the horizon " + fixed(json["radar"]["mean_dbsm"], 1) +
            " dBsm on average\n";
  }
  if (json.contains("glare")) {
    text += "  reflected sunlight at most " + glare_words(json["glare"], json["glare"]) + "\n";
  }
  return {json, text};
}

std::string percent(double share, int digits) { return fixed(100.0 * share, digits) + " %"; }

std::string radar_text(const reflect::ReflectResult& result) {
  if (!result.radar) return "";
  return "  radar cross-section on the horizon " +
         fixed(reflect::mean_dbsm(result.radar->before), 1) + " -> " +
         fixed(reflect::mean_dbsm(result.radar->after), 1) + " dBsm on average\n";
}

std::string glare_text(const reflect::ReflectResult& result) {
  if (!result.glare) return "";
  const nlohmann::json glare = reflect::glare_json(*result.glare);
  return "  reflected sunlight at most " + glare_words(glare["before"], glare) + " before,\n    " +
         glare_words(glare["after"], glare) + " after\n";
}

std::string result_text(const ReflectSettings& settings, const reflect::ReflectResult& result) {
  if (!result.done()) {
    return settings.out + ": interrupted after " + std::to_string(result.updates.size()) +
           " updates\n";
  }
  return settings.out + ": " + std::to_string(result.updates.size()) + " updates in " +
         fixed(result.seconds, 1) + " s\n  energy " + number_text(result.before.total, 4) + " -> " +
         number_text(result.after.total, 4) + " (" +
         percent(result.after.total / result.before.total, 1) + "), of one reflection " +
         number_text(result.before.direct, 4) + " -> " + number_text(result.after.direct, 4) +
         "\n  vertices moved by " + percent(result.mean_displacement, 2) +
         " of the diagonal on average, by " + percent(result.max_displacement, 2) + " at most\n" +
         radar_text(result) + glare_text(result);
}

bool is_of_result(const std::string& name) {
  const auto& all = reflect::reflect_file::kAll;
  return name == reflect::reflect_file::kCheckpoint ||
         std::find(all.begin(), all.end(), name) != all.end();
}

/// @throw InputError if the folder has an unfinished run and no option says to replace or resume
///        it.
void require_no_unfinished_run(const ReflectSettings& settings) {
  std::error_code ignored;
  if (fs::exists(fs::path(settings.out) / reflect::reflect_file::kCheckpoint, ignored) &&
      !settings.resume && !settings.reflect.force) {
    throw InputError("--out " + settings.out +
                     ": holds an unfinished run already; choose another folder, go on with "
                     "--resume or replace it with --force");
  }
}

/// A damaged checkpoint is refused before the mesh is remeshed, which may take minutes.
void require_readable_checkpoint(const ReflectSettings& settings) {
  const fs::path checkpoint = fs::path(settings.out) / reflect::reflect_file::kCheckpoint;
  std::error_code ignored;
  if (settings.resume && fs::exists(checkpoint, ignored)) reflect::read_checkpoint(checkpoint);
}

/// Sets the checkpoint's path and whether the run resumes from one. @return false if the run is
/// already finished.
bool settle_checkpoint(ReflectSettings& settings, const reflect::ReflectInput& input,
                       const OutputFolder& folder, const Console& console) {
  reflect::ReflectOptions& options = settings.reflect;
  options.checkpoint = folder.path() / reflect::reflect_file::kCheckpoint;
  std::error_code ignored;
  const bool unfinished = fs::exists(options.checkpoint, ignored);
  options.resume = settings.resume && unfinished;
  if (unfinished && !options.resume) fs::remove(options.checkpoint, ignored);
  if (!settings.resume || unfinished) return true;
  if (reflect::holds_result(folder.path(), reflect::reflect_fingerprint(input, options))) {
    return false;
  }
  console.note("nothing to resume: started from the beginning");
  return true;
}

/// Writes a shape as STEP. @return the file.
fs::path write_shape_step(CommandFrame& frame, const ReflectSettings& settings,
                          const SurfaceMesh& mesh, const fs::path& folder) {
  const StepHeader header{.name = "lensforge reflector",
                          .description = "reflecting shape",
                          .author = {},
                          .program = program_mark(),
                          .time_stamp = file_time(settings.mesh)};
  write_mesh_step(mesh, header, folder / reflect::reflect_file::kSolid, frame.control());
  return folder / reflect::reflect_file::kSolid;
}

/// STEP of more faces takes minutes and gigabytes.
constexpr std::int64_t kMostStepFaces = 100'000;

void require_step_size(const ReflectSettings& settings, const SurfaceMesh& mesh) {
  if (!settings.step || mesh.triangle_count() <= kMostStepFaces) return;
  throw InputError("--step: the shape has " + std::to_string(mesh.triangle_count()) +
                   " faces: must be at most " + std::to_string(kMostStepFaces) +
                   "; --faces makes fewer, surface.stl has all");
}

CommandResult shape(CommandFrame& frame, ReflectSettings& settings) {
  require_no_unfinished_run(settings);
  require_readable_checkpoint(settings);
  const reflect::ReflectInput input = load(frame, settings);
  require_step_size(settings, input.mesh);
  const OutputFolder& folder = frame.begin_folder(settings.out);
  reflect::require_replaceable_result(folder.path(), settings.reflect.force);
  folder.remove_partial_files(is_of_result);
  if (!settle_checkpoint(settings, input, folder, frame.console())) {
    return {{{"out", settings.out}, {"status", "done"}},
            settings.out + ": the run is finished, there is nothing to resume\n"};
  }
  const reflect::ReflectResult result =
      reflect::reflect_shape(input, settings.reflect, frame.executor(),
                             frame.control([&frame] { frame.console().begin(); }));
  nlohmann::json json = reflect::result_json(result, settings.reflect);
  std::vector<fs::path> files =
      reflect::write_result(result, settings.reflect, folder.path(), frame.executor());
  if (settings.step && result.done()) {
    files.push_back(write_shape_step(frame, settings, result.mesh, folder.path()));
  }
  json["files"] = files_json(files);
  std::error_code ignored;
  if (result.done()) fs::remove(settings.reflect.checkpoint, ignored);
  CommandResult outcome{json, result_text(settings, result),
                        exit_code(result.done(), result.unmet.empty()), result.unmet};
  outcome.notes.push_back(
      result.done() ? "look at " + (folder.path() / reflect::reflect_file::kViews).string()
                    : kContinueWithResume);
  return outcome;
}

CommandResult run(CommandFrame& frame, ReflectSettings& settings) {
  reflect::validate(settings.reflect);
  if (!settings.evaluate && settings.out.empty()) {
    throw InputError("--out: is missing; --out DIR writes a new shape, --evaluate only energies");
  }
  if (settings.evaluate && settings.step) {
    throw InputError("--step: --evaluate writes nothing; leave one of them out");
  }
  return settings.evaluate ? evaluate(frame, settings) : shape(frame, settings);
}

Command<ReflectSettings> reflect_verb() {
  return {"reflect", "Deforms a mesh so that it reflects light as wanted.", run};
}

}  // namespace

int reflect_command(const Arguments& arguments) { return run_command(reflect_verb(), arguments); }

CommandCall reflect_call() { return call_of(reflect_verb(), ReflectSettings()); }

}  // namespace lensforge::app
