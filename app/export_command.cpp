// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cctype>
#include <filesystem>

#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/export_step.h"
#include "app/interruptible_job.h"
#include "app/json_output.h"
#include "app/lens_note.h"
#include "app/option_set.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/surface/lens.h"
#include "core/surface/mesh_io.h"
#include "core/text/version.h"
#include "design/render_lens.h"
#include "export/closed_solid.h"
#include "export/export_work.h"
#include "export/height_map.h"
#include "export/mesh_formats.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

enum class Format { kByExtension, kStep, kIges, kStl, kObj, kPly, k3mf, kExr, kPng };
enum class SurfaceChoice { kDesigned, kMilled };

struct ExportArguments {
  std::string source;
  std::string out;
  bool force = false;
  Format format = Format::kByExtension;
  SurfaceChoice surface = SurfaceChoice::kDesigned;
  int pixels = 1024;
  StepArguments step;
};

const OptionSet::Choices<Format> kFormats{
    {"step", Format::kStep}, {"iges", Format::kIges}, {"stl", Format::kStl}, {"obj", Format::kObj},
    {"ply", Format::kPly},   {"3mf", Format::k3mf},   {"exr", Format::kExr}, {"png", Format::kPng}};

void add_export_options(OptionSet& options, ExportArguments& arguments) {
  options.positional("DIR", arguments.source, "lens folder");
  options.required_text("--out", arguments.out, "FILE", "where to write; its folder is made");
  OptionSet::Choices<Format> formats{{"extension", Format::kByExtension}};
  formats.insert(formats.end(), kFormats.begin(), kFormats.end());
  options.flag("--force", arguments.force, "replace a file that lensforge did not write");
  options.choice(
      "--format", arguments.format, formats,
      "solid as step or iges; closed mesh as stl (binary), obj, ply or 3mf; height map as exr "
      "(32-bit, mm) or "
      "png (16-bit grey)");
  options.choice("--surface", arguments.surface,
                 {{"designed", SurfaceChoice::kDesigned}, {"milled", SurfaceChoice::kMilled}},
                 "the lens's surface, or what the cutter leaves: DIR/cam/milled.ply");
  options.integer("--pixels", arguments.pixels, Limits::between(2, kMaxImageSide),
                  "longer side of a height map");
  add_step_options(options, arguments.step);
}

bool is_height_map(Format format) { return format == Format::kExr || format == Format::kPng; }

bool is_spline_solid(Format format) { return format == Format::kStep || format == Format::kIges; }

std::string word_of(Format format) {
  for (const auto& [word, meaning] : kFormats) {
    if (meaning == format) return word;
  }
  return {};
}

/// The format that --format or the extension asks for.
Format chosen_format(const ExportArguments& arguments) {
  if (arguments.format != Format::kByExtension) return arguments.format;
  std::string extension = fs::path(arguments.out).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string known;
  for (const auto& [word, meaning] : kFormats) {
    if (extension == "." + word) return meaning;
    if (extension == ".stp" && meaning == Format::kStep) return meaning;
    if (extension == ".igs" && meaning == Format::kIges) return meaning;
    known += (known.empty() ? "." : ", .") + word;
  }
  throw InputError("--out " + arguments.out + ": must end in one of " + known +
                   ", or --format must say what to write");
}

void require_fitting_options(const OptionSet& options, Format format) {
  if (options.given("--pixels") && !is_height_map(format)) {
    throw InputError("--pixels: is for height maps (exr, png), not for " + word_of(format));
  }
  if (!is_spline_solid(format)) require_no_step_options(options, word_of(format));
  if (format == Format::kIges && options.given("--schema")) {
    throw InputError("--schema: is for step, not for iges");
  }
}

void require_file_target(const std::string& out) {
  if (is_folder(out)) throw InputError("--out " + out + ": is a folder, not a file");
}

/// What is exported and what it is called in messages.
struct Source {
  Lens lens;  ///< Its surface is the one to export.
  std::string name;
};

Source load(const ExportArguments& arguments) {
  Source source{read_lens(arguments.source), ""};
  fs::path file = fs::path(arguments.source) / lens_file::kSurface;
  if (arguments.surface == SurfaceChoice::kMilled) {
    file = fs::path(arguments.source) / "cam" / "milled.ply";
    source.lens.surface = read_mesh(file);
  }
  source.name = file.string();
  height_field_outline(source.lens.surface, source.name);
  return source;
}

/// What a command says at the end.
using Report = StepReport;

void write_solid(const Source& source, Format format, const std::string& out, InterruptibleJob& job,
                 Report& report) {
  job.control().report({"closed mesh", 0.0, 0.0, ""});
  const SurfaceMesh solid = closed_solid(source.lens.surface, source.name);
  const std::string title = program_mark() + " lens, millimetres";
  job.begin_writing();
  if (format == Format::kStl) write_stl(solid, title, out);
  if (format == Format::kObj) write_obj(solid, title, out);
  if (format == Format::kPly) write_ply(solid, out);
  if (format == Format::k3mf) write_3mf(solid, title, out);
  const double volume = enclosed_volume(solid);
  report.json["triangles"] = solid.triangle_count();
  report.json["volume_mm3"] = volume;
  report.text = "  solid     " + std::to_string(solid.triangle_count()) + " triangles, " +
                fixed(volume / 1000.0, 3) + " cm3\n";
}

void write_height_map(const Source& source, const ExportArguments& arguments, Format format,
                      const Executor& executor, InterruptibleJob& job, Report& report) {
  const SmoothSurface surface(source.lens.surface);
  const Image heights = height_map(surface, arguments.pixels, executor, job.control());
  const double pixel = surface.box().sizes().x() / heights.columns();
  report.json["pixels"] = {heights.columns(), heights.rows()};
  report.json["pixel_mm"] = pixel;
  report.text = "  heights   " + size_text(heights.columns(), heights.rows()) + " pixels of " +
                fixed(pixel, 6) + " mm\n";
  job.begin_writing();
  if (format == Format::kExr) {
    write_image(heights, fs::path(arguments.out), job.control());
    return;
  }
  const GreyScale scale = write_grey_relief(heights, arguments.out, executor, job.control());
  report.json["black_mm"] = scale.black;
  report.json["white_mm"] = scale.white;
  report.text += "  grey      black is z = " + fixed(scale.black, 6) +
                 " mm, white is z = " + fixed(scale.white, 6) + " mm\n";
}

/// Tells what a large height map takes, or refuses it.
void announce_height_map(const Lens& lens, const ExportArguments& arguments, Format format,
                         const Console& console) {
  const auto work = [&](double side) {
    const GridShape shape = height_map_shape(lens.setup.lens_size, static_cast<int>(side));
    return height_map_work(double{1} * shape.columns * shape.rows, format == Format::kPng);
  };
  announce_work(work, "--pixels", arguments.pixels, arguments.out, console);
}

/// The picture of the surface as facets and as the smooth part that is made of them.
void compare_pictures(const Lens& lens, const Executor& executor, Report& report) {
  for (const SurfaceModel model : kSurfaceModels) {
    const ImageMetrics metrics =
        evaluate(lens.surface, lens.setup, model, lens.target, nullptr, executor);
    const std::string word = model_name(model);
    report.json["metrics"][word] = metrics_json(metrics);
    report.text += "  " + word + std::string(10 - word.size(), ' ') + metrics_text(metrics) + "\n";
  }
}

Report write(const Source& source, const ExportArguments& arguments, Format format,
             const Executor& executor, InterruptibleJob& job, const Console& console) {
  if (is_spline_solid(format)) {
    StepArguments step = arguments.step;
    step.iges = format == Format::kIges;
    return export_step(source.lens, source.name, arguments.out, step, executor, job, console);
  }
  Report report;
  report.within_tolerance = true;
  if (is_height_map(format)) {
    write_height_map(source, arguments, format, executor, job, report);
  } else {
    write_solid(source, format, arguments.out, job, report);
  }
  return report;
}

}  // namespace

int export_command(const Arguments& command_line) try {
  ExportArguments arguments;
  OptionSet options("export", "Writes a lens as a closed solid or height map for other programs.");
  add_export_options(options, arguments);
  options.parse(command_line);
  const Format format = chosen_format(arguments);
  require_fitting_options(options, format);
  require_file_target(arguments.out);
  require_replaceable("--out", arguments.out, arguments.force);
  const Console console(options.common().json, options.common().quiet);
  const Source source = load(arguments);
  note_unfinished_design(source.lens, console);
  InterruptibleJob job(options.common(), arguments.out);
  const Executor executor = job.stoppable(options.executor());
  if (is_height_map(format)) announce_height_map(source.lens, arguments, format, console);
  Report pictures;
  compare_pictures(source.lens, executor, pictures);
  Report report = write(source, arguments, format, executor, job, console);
  report.json["metrics"].update(pictures.json["metrics"]);
  report.json["command"] = "export";
  report.json["out"] = arguments.out;
  report.json["format"] = word_of(format);
  report.json["bytes"] = fs::file_size(arguments.out);
  console.result(report.json, arguments.out + "\n" + report.text + pictures.text);
  if (report.within_tolerance) return kDone;
  console.note("warning: the tolerances do not hold everywhere; --max-points gives more room");
  return kLimitMissed;
} catch (const Interrupted&) {
  const bool json =
      std::find(command_line.begin(), command_line.end(), "--json") != command_line.end();
  return report_interrupted(json);
}

}  // namespace lensforge::app
