// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <filesystem>
#include <string>

#include "app/command_line.h"
#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/export_output.h"
#include "app/export_settings.h"
#include "app/interruptible_job.h"
#include "app/lens_note.h"
#include "core/error.h"
#include "export/export.h"

namespace lensforge::app {

namespace {

/// What the library is told by the source that it is given.
const OptionTable<ExportSettings>& source_fields() {
  static const OptionTable<ExportSettings> table{Row<ExportSettings>::word<ExportSurface>(
      "--surface", &ExportSettings::surface,
      {{"designed", ExportSurface::kDesigned}, {"milled", ExportSurface::kMilled}},
      "the lens's surface, or what the cutter leaves: DIR/cam/milled.ply")};
  return table;
}

/// What helps where the splines of a mesh miss its tolerances. More control points do not where no
/// surface has all of its normals.
std::string remedy_for(const SplineSolid& solid, ExportSurface surface) {
  std::string remedy = solid.fit->bound.share_above > 0.0
                           ? ": the normals of the mesh contradict each other"
                           : "; --max-points gives more room";
  if (surface == ExportSurface::kDesigned) {
    remedy += "; a lens of design --model spline is written exactly as it is";
  }
  return remedy;
}

}  // namespace

void add_export_options(OptionSet& options, ExportSettings& settings) {
  options.positional("DIR", settings.source, "lens folder");
  options.required_text("--out", settings.out, "FILE", "file to write; its folder is created");
  options.fields(source_fields(), settings);
  options.fields(export_fields(), settings.options);
}

void require_fitting_options(const OptionSet& options, ExportFormat format) {
  if (options.given("--pixels") && !is_height_map(format)) {
    throw InputError("--pixels: is for height maps (exr, png), not for " + word_of(format));
  }
  constexpr std::array kOfSplines{"--tolerance", "--normal-tolerance", "--max-points", "--schema",
                                  "--author"};
  for (const char* name : kOfSplines) {
    if (options.given(name) && !is_spline_solid(format)) {
      throw InputError(std::string(name) + ": is for step and iges, not for " + word_of(format));
    }
  }
  if (format == ExportFormat::kIges && options.given("--schema")) {
    throw InputError("--schema: is for step, not for iges");
  }
}

int export_command(const Arguments& command_line) try {
  ExportSettings settings;
  OptionSet options("export", "Writes a lens as a closed solid or height map for other programs.");
  add_export_options(options, settings);
  options.parse(command_line);
  require_fitting_options(options, export_format(settings.options, settings.out));
  validate(settings.options, settings.out);
  const Console console(options.common().json, options.common().quiet);
  const ExportSource source = read_export_source(settings.source, settings.surface);
  note_unfinished_design(source.lens, console);
  InterruptibleJob job(options.common(), settings.out);
  const ExportHooks hooks{[&](const WorkEstimate& needed) { announce_work(needed, console); },
                          [&] { job.begin_writing(); }};
  const ExportResult result = export_lens(source, settings.out, settings.options,
                                          job.stoppable(options.executor()), job.control(), hooks);
  ExportReport report = export_report(result);
  report.json["command"] = "export";
  report.json["out"] = settings.out;
  report.json["format"] = word_of(result.format);
  report.json["bytes"] = std::filesystem::file_size(settings.out);
  console.result(report.json, settings.out + "\n" + report.text);
  if (result.within_tolerance()) return kDone;
  console.note("warning: the tolerances do not hold everywhere" +
               remedy_for(*result.splines, settings.surface));
  return kLimitMissed;
} catch (const Interrupted&) {
  return report_interrupted(wants_json(command_line));
}

}  // namespace lensforge::app
