// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "app/commands/settings.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "core/error.h"
#include "export/export.h"

namespace lensforge::app {
namespace {

std::string scientific(double value) {
  std::array<char, 32> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.2g", value);
  return {text.data(), static_cast<std::size_t>(length)};
}

std::string place_text(const Eigen::Vector2d& xy) {
  return "x " + fixed(xy.x(), 2) + ", y " + fixed(xy.y(), 2);
}

nlohmann::json certificate(const SplineNet& net) {
  nlohmann::json patches = nlohmann::json::array();
  for (const SplinePatch& patch : net.patches) {
    const auto range = [&](std::size_t k) {
      const Eigen::MatrixXd& part = patch.coefficients[k];
      return nlohmann::json{part.minCoeff(), part.maxCoeff()};
    };
    patches.push_back({{"x", range(0)},
                       {"y", range(1)},
                       {"cells", patch.cells_u},
                       {"cells_v", patch.cells_v},
                       {"height_error_mm", patch.error.height},
                       {"normal_error_rad", patch.error.normal},
                       {"share_within_tolerance", patch.error.share_within()}});
  }
  return patches;
}

void describe_fit(const SplineNet& net, const FitOptions& fit, CommandResult& report) {
  const FitError error = net.error();
  const auto good =
      std::count_if(net.patches.begin(), net.patches.end(),
                    [&](const SplinePatch& patch) { return holds(patch.error, fit); });
  report.json["height_error_mm"] = error.height;
  report.json["normal_error_rad"] = error.normal;
  report.json["height_rms_mm"] = error.height_rms;
  report.json["normal_rms_rad"] = error.normal_rms;
  report.json["worst_height_at_mm"] = {error.height_at.x(), error.height_at.y()};
  report.json["worst_normal_at_mm"] = {error.normal_at.x(), error.normal_at.y()};
  report.json["share_within_tolerance"] = error.share_within();
  report.json["within_tolerance"] = holds(error, fit);
  report.json["patches_within_tolerance"] = good;
  report.json["control_points"] = net.control_points();
  report.json["patches"] = certificate(net);
  report.text += "  fit       " + std::to_string(good) + " of " +
                 std::to_string(net.patches.size()) + " patches within tolerance, " +
                 fixed(100.0 * error.share_within(), 1) + " % of the area, " +
                 std::to_string(net.control_points()) + " control points\n" + "  worst     " +
                 scientific(error.height) + " mm at " + place_text(error.height_at) + " (limit " +
                 scientific(fit.tolerance) + "), normal " + scientific(error.normal) + " rad at " +
                 place_text(error.normal_at) + " (limit " + scientific(fit.normal_tolerance) +
                 ")\n" + "  rms       " + scientific(error.height_rms) + " mm, normal " +
                 scientific(error.normal_rms) + " rad\n";
}

void describe_bound(const NormalBound& bound, CommandResult& report) {
  report.json["least_possible_normal_error_rad"] = bound.largest;
  report.json["share_no_surface_can_hold"] = bound.share_above;
  report.text +=
      "  possible  normals of the mesh contradict each other: " + scientific(bound.largest) +
      " rad off at least at " + place_text(bound.at) + "; on " +
      fixed(100.0 * bound.share_above, 1) + " % of the area no surface holds the limit\n";
}

void describe_solid(const SolidContent& content, double facets, CommandResult& report) {
  report.json["faces"] = content.faces;
  report.json["volume_mm3"] = content.volume;
  report.json["mesh_volume_mm3"] = facets;
  report.text += "  solid     " + std::to_string(content.faces) + " faces, " +
                 fixed(content.volume / 1000.0, 3) + " cm3 (facets: " + fixed(facets / 1000.0, 3) +
                 "), read back valid and closed\n";
}

void describe_metrics(const std::string& word, const ImageMetrics& metrics, CommandResult& report) {
  report.json["metrics"][word] = metrics_json(metrics);
  report.text += "  " + word + std::string(10 - word.size(), ' ') + metrics_text(metrics) + "\n";
}

void describe(const SplineSolid& solid, CommandResult& report) {
  describe_solid(solid.content, solid.mesh_volume, report);
  if (solid.fit) {
    describe_fit(solid.net, solid.fit->options, report);
    describe_bound(solid.fit->bound, report);
  } else {
    report.json["control_points"] = solid.net.control_points();
    report.text += "  spline    the lens's own, " + std::to_string(solid.net.control_points()) +
                   " control points\n";
  }
  describe_metrics("solid", solid.picture, report);
}

void describe(const MeshSolid& solid, CommandResult& report) {
  report.json["triangles"] = solid.triangles;
  report.json["volume_mm3"] = solid.volume;
  report.text = "  solid     " + std::to_string(solid.triangles) + " triangles, " +
                fixed(solid.volume / 1000.0, 3) + " cm3\n";
}

void describe(const HeightMap& map, CommandResult& report) {
  report.json["pixels"] = {map.pixels.columns, map.pixels.rows};
  report.json["pixel_mm"] = map.pixel;
  report.text = "  heights   " + size_text(map.pixels.columns, map.pixels.rows) + " pixels of " +
                fixed(map.pixel, 6) + " mm\n";
  if (!map.scale) return;
  report.json["black_mm"] = map.scale->black;
  report.json["white_mm"] = map.scale->white;
  report.text += "  grey      black is z = " + fixed(map.scale->black, 6) +
                 " mm, white is z = " + fixed(map.scale->white, 6) + " mm\n";
}

}  // namespace

CommandResult export_report(const ExportResult& result) {
  CommandResult report;
  if (result.splines) describe(*result.splines, report);
  if (result.mesh) describe(*result.mesh, report);
  if (result.heights) describe(*result.heights, report);
  for (const auto& [model, metrics] : result.metrics) {
    describe_metrics(model_name(model), metrics, report);
  }
  return report;
}

namespace {

/// Remedy if splines miss a mesh's tolerances. More control points do not help if no surface has
/// all its normals.
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

void describe(Description& d, ExportSettings& settings) {
  d.text("DIR", settings.source, "", "lens folder").needed = true;
  d.text("--out", settings.out, "FILE", "file to write; its folder is created").needed = true;
  d.word("--surface", settings.surface,
         {{"designed", ExportSurface::kDesigned}, {"milled", ExportSurface::kMilled}},
         "the lens's surface, or what the cutter leaves: DIR/cam/milled.ply");
  describe(d, settings.options);
}

void require_fitting_options(const OptionSet& options, const ExportFormat& format) {
  if (options.given("--pixels") && !is_height_map(format)) {
    throw InputError("--pixels: is for height maps (exr, png), not for " + format);
  }
  constexpr std::array kOfSplines{"--tolerance", "--normal-tolerance", "--max-points", "--schema",
                                  "--author"};
  for (const char* name : kOfSplines) {
    if (options.given(name) && !is_spline_solid(format)) {
      throw InputError(std::string(name) + ": is for step and iges, not for " + format);
    }
  }
  if (format == "iges" && options.given("--schema")) {
    throw InputError("--schema: is for step, not for iges");
  }
}

namespace {

CommandResult run(CommandFrame& frame, ExportSettings& settings) {
  require_fitting_options(frame.options(), export_format(settings.options, settings.out));
  validate(settings.options, settings.out);
  const ExportSource source = read_export_source(settings.source, settings.surface);
  note_unfinished_design(source.lens, frame.console());
  frame.begin_file(settings.out);
  const ExportHooks hooks{
      [&](const WorkEstimate& needed) { announce_work(needed, frame.console()); },
      [&] { frame.begin_writing(); }};
  const ExportResult result =
      export_lens(source, settings.out, settings.options, frame.executor(), frame.control(), hooks);
  CommandResult report = export_report(result);
  report.json["out"] = settings.out;
  report.json["format"] = result.format;
  report.json["bytes"] = std::filesystem::file_size(settings.out);
  report.text = settings.out + "\n" + report.text;
  if (!result.within_tolerance()) {
    report.exit_code = kLimitMissed;
    report.notes.push_back("warning: the tolerances do not hold everywhere" +
                           remedy_for(*result.splines, settings.surface));
  }
  return report;
}

}  // namespace

int export_command(const Arguments& arguments) {
  return run_command<ExportSettings>(
      {"export", "Writes a lens as a closed solid or height map for other programs.", run},
      arguments);
}

}  // namespace lensforge::app
