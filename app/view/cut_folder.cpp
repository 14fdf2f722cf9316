// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/cut_folder.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <system_error>

#include "cam/cam.h"
#include "cam/post/program_reader.h"
#include "cam/predict/part_surfaces.h"
#include "core/error.h"
#include "core/image/layered_image.h"
#include "core/io/cut_layers.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/json_fields.h"
#include "core/text/json_text.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Of report.json, which has some 30 kB.
constexpr std::uintmax_t kMaxReportBytes = std::uintmax_t{16} << 20U;
/// Of leakage.png.
constexpr std::uintmax_t kMaxMapBytes = std::uintmax_t{64} << 20U;
/// Between the points of a path that is shown, mm.
constexpr double kPathSpacing = 0.5;

[[noreturn]] void refuse(const fs::path& file, const std::string& rule) {
  throw InputError(file.string() + ": " + rule + "; run cam again");
}

/// A surface of part.exr as a grid of nodes with normals.
SampledSurface surface_of(const LayeredImage& layers, const std::string& name,
                          const Eigen::Vector2d& size, const fs::path& file) {
  for (const char* layer : {".z", ".slope_x", ".slope_y"}) {
    if (!layers.has(name + layer)) refuse(file, "has no layer " + name + layer);
  }
  const GridShape shape{layers.columns(), layers.rows()};
  if (shape.columns < 2 || shape.rows < 2) refuse(file, "is too small");
  SampledSurface surface = make_samples(shape);
  const auto z = layers.layer(name + ".z");
  const auto slope_x = layers.layer(name + ".slope_x");
  const auto slope_y = layers.layer(name + ".slope_y");
  for (int row = 0; row < shape.rows; ++row) {
    for (int column = 0; column < shape.columns; ++column) {
      const auto from = static_cast<std::size_t>((shape.rows - 1 - row) * shape.columns + column);
      const Eigen::Index to = Eigen::Index{row} * shape.columns + column;
      surface.mesh.vertices.col(to) << size.x() * column / (shape.columns - 1),
          size.y() * row / (shape.rows - 1), z[from];
      surface.normals.col(to) << -slope_x[from], -slope_y[from], 1.0;
    }
  }
  return surface;
}

Image picture_of(const LayeredImage& layers, const std::string& name) {
  Image image(layers.columns(), layers.rows());
  const auto layer = layers.layer(name);
  std::copy(layer.begin(), layer.end(), image.values().begin());
  return image;
}

std::vector<CausePicture> causes_of(const JsonFields& report, const fs::path& folder,
                                    const OpticalSetup& setup) {
  const fs::path file = folder / lens_file::kCausePictures;
  const LayeredImage layers = read_layers(file);
  if (layers.columns() != setup.pixels.x() || layers.rows() != setup.pixels.y()) {
    refuse(file, "is of another lens");
  }
  const std::string designed = surface_name::kDesigned;
  if (!layers.has(designed)) refuse(file, "has no layer " + designed);
  std::vector<CausePicture> causes{{"the surface between vertices", picture_of(layers, designed)}};
  for (const nlohmann::json& entry : report.object("leakage").at("causes")) {
    const std::string cause =
        JsonFields(entry, (folder / cam_file::kReport).string(), "leakage.causes.").text("cause");
    if (!layers.has(cause)) refuse(file, "has no layer " + cause);
    causes.push_back({cause, picture_of(layers, cause)});
  }
  if (causes.size() < 2) refuse(file, "names no cause");
  return causes;
}

/// Reads a program by the first of the built-in dialects that takes it; a path that none takes is
/// not shown.
std::optional<ReportPath> sketch_of(const fs::path& program, const std::string& operation,
                                    double z_offset, const RunControl& control) {
  for (GcodeDialect dialect : {linuxcnc_dialect(), fanuc_dialect(), grblhal_dialect(),
                               grbl_dialect(), weihong_dialect()}) {
    dialect.spindle_by_hand = true;  // How it is switched does not matter for a picture.
    PathSketch sketch(operation, kPathSpacing);
    const auto take = [&](const GcodeMotion& motion, int) {
      PathMove move;
      move.kind = motion.rapid ? MoveKind::kRapid : MoveKind::kCut;
      move.end = motion.end - Eigen::Vector3d(0.0, 0.0, z_offset);
      sketch.add({&move, 1});
    };
    try {
      read_program(program, dialect, take, control);
      return sketch.path();
    } catch (const InputError&) {
    }
  }
  return std::nullopt;
}

bool finishes(const std::string& operation) { return operation != "rough" && operation != "semi"; }

std::vector<ReportPath> path_of(const JsonFields& report, const fs::path& folder,
                                const RunControl& control) {
  std::vector<ReportPath> path;
  if (report.text("part") != "lens") return path;
  for (const nlohmann::json& entry : report.at("operations")) {
    const JsonFields operation(entry, (folder / cam_file::kReport).string(), "operations.");
    const fs::path file = operation.text("file");
    if (!finishes(operation.text("name")) || file != file.filename()) continue;
    auto sketch =
        sketch_of(folder / file, operation.text("name"), report.number("z_offset"), control);
    if (sketch) path.push_back(std::move(*sketch));
  }
  return path;
}

}  // namespace

CutForecast read_forecast(const fs::path& lens_folder, const Lens& lens,
                          const RunControl& control) {
  const fs::path folder = lens_folder / lens_file::kCut;
  const fs::path file = folder / cam_file::kReport;
  std::error_code none;
  if (!fs::exists(file, none)) return {};
  const nlohmann::json document = parse_json(read_whole_file(file, kMaxReportBytes), file.string());
  const JsonFields report(document, file.string());
  CutForecast forecast;
  if (!report.has("leakage")) {
    forecast.note = "was made with --no-render and predicts no part";
    return forecast;
  }
  for (const char* name :
       {lens_file::kPartSurfaces, lens_file::kCausePictures, cam_file::kLeakage}) {
    if (fs::exists(folder / name, none)) continue;
    forecast.note = std::string("holds no ") + name + "; run cam again to see the part";
    return forecast;
  }
  forecast.causes = causes_of(report, folder, lens.setup);
  const fs::path surfaces = folder / lens_file::kPartSurfaces;
  const LayeredImage layers = read_layers(surfaces);
  const Eigen::Vector2d& size = lens.setup.lens_size;
  forecast.polished = surface_of(layers, part_layer::kPolished, size, surfaces);
  forecast.part = surface_of(layers, part_layer::kPart, size, surfaces);
  forecast.leakage_map = read_whole_file(folder / cam_file::kLeakage, kMaxMapBytes);
  forecast.path = path_of(report, folder, control);
  return forecast;
}

}  // namespace lensforge
