// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/lens.h"

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/optical_surface.h"
#include "core/lens/setup_json.h"
#include "core/lens/surface_check.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/outline.h"
#include "core/schema/json.h"
#include "core/spline/control_net.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kFormat = "lensforge.lens";
constexpr int kVersion = 1;
/// Key beside the metrics of the models.
constexpr const char* kSourceLimit = "source_limit";
constexpr const char* kSecond = "second";
/// Maximum size of lens.json, which has about 2 kB.
constexpr std::uintmax_t kMaxJsonBytes = std::uintmax_t{1} << 20U;

std::string size_text(int columns, int rows) {
  return std::to_string(columns) + " x " + std::to_string(rows);
}

ordered_json to_json(const Lens& lens) {
  const GridShape& grid = lens.surface.grid;
  ordered_json document = {{"format", kFormat}, {"version", kVersion}, {"units", "mm"}};
  document.update(setup_json(lens.setup));
  document.update(ordered_json{
      {"model", model_name(lens.model)},
      {"surface", lens_file::kSurface},
      {"grid", grid.is_grid() ? ordered_json::array({grid.columns, grid.rows}) : ordered_json()},
      {"metrics", metrics_json(lens)},
      {"provenance", ordered_json(lens.provenance.json())},
  });
  if (lens.spline) document["spline"] = lens_file::kSpline;
  if (lens.setup.outline && !lens.spline) document["sheet"] = lens_file::kSheet;
  return document;
}

/// Heights of a front that is a height map, otherwise nullptr.
const HeightGrid* front_heights(const OpticalSetup& setup) {
  const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
  return map != nullptr ? &map->spline->grid() : nullptr;
}

void add_files(const Lens& lens, PendingFiles& files) {
  using namespace lens_file;
  const auto add = [&files](const char* name, const auto& content) {
    files.add(name, [&](const fs::path& beside) { write_image(content, beside); });
  };
  if (lens.spline || (lens.setup.outline && lens.model == SurfaceModel::kSmooth)) {
    const SampledSurface part = lens_part(lens, Executor::serial());
    files.add(kSurface,
              [&](const fs::path& beside) { write_ply(part.mesh, part.normals, beside); });
  } else if (lens.setup.outline) {
    const SurfaceMesh part = lens_part(lens, Executor::serial()).mesh;
    files.add(kSurface, [&](const fs::path& beside) { write_ply(part, beside); });
  } else {
    files.add(kSurface, [&](const fs::path& beside) { write_ply(lens.surface, beside); });
  }
  if (lens.spline) {
    files.add(kSpline, [&](const fs::path& beside) { write_spline(*lens.spline, beside); });
  } else if (lens.setup.outline) {
    files.add(kSheet, [&](const fs::path& beside) { write_ply(lens.surface, beside); });
  }
  if (const HeightGrid* const heights = front_heights(lens.setup)) {
    files.add(kFront, [heights](const fs::path& beside) { write_heights(*heights, beside); });
  }
  add(kTargetPng, lens.target);
  add(kTargetExr, lens.target);
  if (!lens.render.empty()) {
    add(kRenderPng, lens.render);
    add(kRenderExr, lens.render);
    add(kError, error_image(lens.render, lens.target));
  }
  if (lens.second) {
    add(kSecondTargetPng, lens.second->target);
    add(kSecondTargetExr, lens.second->target);
    if (!lens.second->render.empty()) {
      add(kSecondRenderPng, lens.second->render);
      add(kSecondRenderExr, lens.second->render);
    }
  }
  files.add(kJson, to_json(lens).dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

/// Removes the lens.json of an old lens in the folder, and those of its files that this lens does
/// not have, so none of them stays beside the new lens.
void remove_older(const PendingFiles& files) {
  using namespace lens_file;
  fs::remove(files.folder() / kJson);
  for (const char* name :
       {kSurface, kSpline, kSheet, kFront, kTargetPng, kTargetExr, kRenderPng, kRenderExr, kError,
        kSecondTargetPng, kSecondTargetExr, kSecondRenderPng, kSecondRenderExr}) {
    if (!files.has(name)) fs::remove(files.folder() / name);
  }
}

void check_sizes(const Lens& lens) {
  LF_CHECK(lens.spline.has_value() == (lens.model == SurfaceModel::kSpline),
           model_name(lens.model));
  const Eigen::Vector2i& pixels = lens.setup.pixels;
  const auto fits = [&](const Image& image) {
    return image.columns() == pixels.x() && image.rows() == pixels.y();
  };
  LF_CHECK(fits(lens.target), size_text(lens.target.columns(), lens.target.rows()));
  LF_CHECK(lens.render.empty() || fits(lens.render),
           size_text(lens.render.columns(), lens.render.rows()));
  LF_CHECK(lens.second.has_value() == lens.setup.second.has_value(), "second picture");
}

json read_json(const fs::path& path) {
  return parse_json(read_whole_file(path, kMaxJsonBytes), path.string());
}

void check_supported(const JsonFields& fields) {
  if (fields.text("format") != kFormat) {
    fields.refuse("format", std::string("only \"") + kFormat + "\" can be read");
  }
  if (fields.integer("version") != kVersion) {
    fields.refuse("version",
                  "only version " + std::to_string(kVersion) + " can be read by this program");
  }
  if (fields.text("units") != "mm") fields.refuse("units", "only \"mm\" can be read");
}

OpticalSetup read_setup(const JsonFields& fields, const fs::path& folder, const std::string& file) {
  OpticalSetup setup = read_setup(fields, folder);
  try {
    validate(setup);
  } catch (const InputError& error) {
    throw InputError(file + ": field " + error.what());
  }
  require_agreement(fields, setup);
  if (setup.pixels.maxCoeff() > kMaxImageSide) {
    fields.refuse("pixels", "at most " + std::to_string(kMaxImageSide) + " a side");
  }
  return setup;
}

ImageMetrics read_metrics(const JsonFields& fields) {
  ImageMetrics metrics;
  read_json(description_of(metrics), fields);
  return metrics;
}

GridShape read_grid(const JsonFields& fields, const SurfaceMesh& mesh) {
  if (fields.at("grid").is_null()) return {};
  const Eigen::Vector2i shape = fields.integer_pair("grid");
  const std::int64_t vertices = std::int64_t{shape.x()} * shape.y();
  if (shape.minCoeff() < 1 || vertices != mesh.vertex_count()) {
    fields.refuse("grid", "the surface has " + std::to_string(mesh.vertex_count()) + " vertices");
  }
  const GridShape grid{shape.x(), shape.y()};
  if (const auto fault = grid_fault(mesh, grid)) fields.refuse("grid", *fault);
  return grid;
}

ControlNet read_own_spline(const JsonFields& fields, const OpticalSetup& setup,
                           const fs::path& folder) {
  const fs::path path = named_file(fields, "spline", folder);
  ControlNet net = read_spline(path);
  if (const auto fault = spline_fault(net, setup)) throw InputError(path.string() + ": " + *fault);
  return net;
}

/// Maximum distance of a spline's mesh from its nodes, mm.
constexpr double kNodeTolerance = 1e-6;

/// @throw InputError unless the mesh matches the spline's nodes.
void check_nodes(const SurfaceMesh& mesh, const ControlNet& net, const fs::path& folder) {
  const SurfaceMesh nodes = spline_nodes(net, kMeshSamples).mesh;
  if (mesh.vertex_count() == nodes.vertex_count() &&
      (mesh.vertices - nodes.vertices).cwiseAbs().maxCoeff() <= kNodeTolerance) {
    return;
  }
  throw InputError(folder.string() + ": " + lens_file::kSurface + " and " + lens_file::kSpline +
                   " hold two surfaces; the mesh must have the spline's nodes, " +
                   size_text(nodes.grid.columns, nodes.grid.rows));
}

/// @throw InputError unless the mesh of a lens with an outline is cut out of its sheet or spline.
void check_part(const SurfaceMesh& mesh, const Lens& lens, const fs::path& folder) {
  const SurfaceMesh part = lens_part(lens, Executor::serial()).mesh;
  if (mesh.vertex_count() == part.vertex_count() &&
      mesh.triangle_count() == part.triangle_count() &&
      (mesh.vertices - part.vertices).cwiseAbs().maxCoeff() <= kNodeTolerance) {
    return;
  }
  throw InputError(folder.string() + ": " + lens_file::kSurface + " and " +
                   (lens.spline ? lens_file::kSpline : lens_file::kSheet) +
                   " hold two surfaces; the mesh must be what the outline leaves of the other, " +
                   std::to_string(part.vertex_count()) + " vertices");
}

/// @param field  the field that names the file.
SurfaceMesh read_surface(const JsonFields& fields, const std::string& field,
                         const OpticalSetup& setup, const fs::path& folder) {
  const fs::path file = named_file(fields, field, folder);
  SurfaceMesh mesh = read_mesh(file);
  if (const auto fault = surface_fault(mesh, setup)) {
    throw InputError(file.string() + ": " + *fault);
  }
  mesh.grid = read_grid(fields, mesh);
  // A grid is already checked cell by cell, which is faster.
  const auto fault = mesh.grid.is_grid() ? std::nullopt : height_field_fault(mesh, setup.lens_size);
  if (fault) throw InputError(file.string() + ": " + *fault);
  return mesh;
}

/// Sets the surface; a spline is already read.
void read_surfaces(const JsonFields& fields, const fs::path& folder, Lens& lens) {
  if (!lens.setup.outline) {
    lens.surface = read_surface(fields, "surface", lens.setup, folder);
    if (lens.spline) check_nodes(lens.surface, *lens.spline, folder);
    return;
  }
  if (lens.spline) {
    lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
    lens.surface.grid = read_grid(fields, lens.surface);
  } else {
    lens.surface = read_surface(fields, "sheet", lens.setup, folder);
  }
  check_part(read_mesh(named_file(fields, "surface", folder)), lens, folder);
}

Image read_picture(const fs::path& path, const OpticalSetup& setup) {
  Image image = read_image(path).image;
  if (image.columns() != setup.pixels.x() || image.rows() != setup.pixels.y()) {
    throw InputError(path.string() + ": is " + size_text(image.columns(), image.rows()) +
                     " pixels, field 'pixels' of " + lens_file::kJson + " says " +
                     size_text(setup.pixels.x(), setup.pixels.y()));
  }
  return image;
}

/// The same; an empty picture if there is no such file.
Image read_picture_if_there(const fs::path& path, const OpticalSetup& setup) {
  std::error_code none;
  if (fs::status(path, none).type() == fs::file_type::not_found) return {};
  return read_picture(path, setup);
}

}  // namespace

ordered_json metrics_json(const ImageMetrics& metrics) { return json_of(description_of(metrics)); }

ordered_json metrics_json(const ModelMetrics& metrics) {
  ordered_json by_model;
  for (const auto& [model, one] : metrics) by_model[model_name(model)] = metrics_json(one);
  return by_model;
}

ordered_json metrics_json(const Lens& lens) {
  ordered_json by_model = metrics_json(lens.metrics);
  if (lens.source_limit) by_model[kSourceLimit] = metrics_json(*lens.source_limit);
  if (lens.second) by_model[kSecond] = metrics_json(lens.second->metrics);
  return by_model;
}

Provenance::Provenance() : Provenance(json::object()) {}

Provenance::Provenance(nlohmann::json object)
    : object_(std::make_shared<const nlohmann::json>(std::move(object))) {}

std::vector<SurfaceModel> models_of(const Lens& lens) {
  std::vector<SurfaceModel> models(kMeshModels.begin(), kMeshModels.end());
  if (lens.spline) models.push_back(SurfaceModel::kSpline);
  return models;
}

std::shared_ptr<const OpticalSurface> optical_surface(const Lens& lens, SurfaceModel model) {
  if (model != SurfaceModel::kSpline) return optical_surface(lens.surface, model);
  LF_CHECK(lens.spline.has_value(), model_name(lens.model));
  return std::make_shared<const SplineSurface>(*lens.spline);
}

SampledSurface lens_part(const Lens& lens, const Executor& executor) {
  SampledSurface whole;
  if (lens.spline) {
    whole = spline_nodes(*lens.spline, kMeshSamples);
  } else {
    whole = {lens.surface, vertex_area_normals(lens.surface)};
  }
  if (!lens.setup.outline) return whole;
  return part_inside(whole.mesh, whole.normals,
                     cut_mesh(whole.mesh, *lens.setup.outline, executor));
}

void write_lens(const Lens& lens, PendingFiles files) {
  check_sizes(lens);
  try {
    add_files(lens, files);
    remove_older(files);
    files.publish();
  } catch (const fs::filesystem_error& error) {
    throw RunError(files.folder().string() + ": cannot be written: " + error.code().message());
  }
}

void write_lens(const Lens& lens, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw RunError(folder.string() + ": cannot be written: " + error.message());
  write_lens(lens, PendingFiles(folder));
}

Lens read_lens(const fs::path& folder) {
  const fs::path path = folder / lens_file::kJson;
  const json document = read_json(path);
  const JsonFields fields(document, path.string());
  check_supported(fields);
  Lens lens;
  lens.setup = read_setup(fields, folder, path.string());
  lens.model = word_in(fields, "model", named_models());
  if (lens.model == SurfaceModel::kSpline)
    lens.spline = read_own_spline(fields, lens.setup, folder);
  const JsonFields metrics = fields.object("metrics");
  for (const SurfaceModel model : models_of(lens)) {
    lens.metrics[model] = read_metrics(metrics.object(model_name(model)));
  }
  if (metrics.has(kSourceLimit)) {
    lens.source_limit = read_metrics(metrics.object(kSourceLimit));
  }
  if (!fields.at("provenance").is_object()) fields.refuse("provenance", "it must be an object");
  lens.provenance = fields.at("provenance");
  read_surfaces(fields, folder, lens);
  lens.target = read_picture(folder / lens_file::kTargetExr, lens.setup);
  lens.render = read_picture_if_there(folder / lens_file::kRenderExr, lens.setup);
  if (lens.setup.second) {
    lens.second = {read_picture(folder / lens_file::kSecondTargetExr, lens.setup),
                   read_picture_if_there(folder / lens_file::kSecondRenderExr, lens.setup),
                   read_metrics(metrics.object(kSecond))};
  }
  return lens;
}

}  // namespace lensforge
