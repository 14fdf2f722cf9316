// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/lens_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "cam/cam.h"
#include "cam/post/program_reader.h"
#include "cam/predict/part_surfaces.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/image/rasters.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "design/render.h"
#include "machine/gcode.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {
namespace {

/// Bytes per coordinate on a grid, an offset of a few cells: with 640 cells on 100 mm the error is
/// 10 nm.
constexpr int kPlaceBytes = 2;
/// Bytes per coordinate on a mesh that is no grid.
constexpr int kFreePlaceBytes = 3;
/// Heights make the facets' slopes: 16 bits would move their light by tenths of a pixel.
constexpr int kHeightBytes = 3;
/// A slope of 0.3 is off by 5 µrad, which moves its light by less than 1 µm at 300 mm.
constexpr int kSlopeBytes = 2;

/// Numbers no farther apart, mm, are the same: x and y of an even grid differ by rounding.
constexpr double kSame = 1e-9;

/// Packs one number per vertex, relative to `base`, and replaces it by the decoded value.
template <class Row, class Base>
StoredChannel pack(const std::string& name, int bytes, Row row, const Base& base) {
  StoredChannel channel{name, bytes, 0.0, 0.0, {}};
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    const double value = row[v] - base(v);
    channel.low = v == 0 ? value : std::min(channel.low, value);
    channel.high = v == 0 ? value : std::max(channel.high, value);
  }
  if (channel.high - channel.low < kSame) {
    channel.bytes = 0;
    return channel;
  }
  PackedNumbers numbers(bytes);
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    row[v] = base(v) + numbers.add(row[v] - base(v), channel.low, channel.high);
  }
  channel.text = numbers.text();
  return channel;
}

void add_places(StoredSurface& stored, const Eigen::Vector2d& lens_size) {
  SurfaceMesh& mesh = stored.read_back.mesh;
  const GridShape& grid = mesh.grid;
  for (int axis = 0; axis < 2; ++axis) {
    const auto even = [&](Eigen::Index v) {
      if (!grid.is_grid()) return 0.0;
      const Eigen::Index at = axis == 0 ? v % grid.columns : v / grid.columns;
      const int cells = (axis == 0 ? grid.columns : grid.rows) - 1;
      return lens_size[axis] * static_cast<double>(at) / cells;
    };
    const int bytes = grid.is_grid() ? kPlaceBytes : kFreePlaceBytes;
    stored.channels.push_back(pack(axis == 0 ? "x" : "y", bytes, mesh.vertices.row(axis), even));
  }
}

void add_slopes(StoredSurface& stored, const Eigen::Matrix3Xd& normals) {
  Eigen::Matrix3Xd& kept = stored.read_back.normals;
  kept = -normals.cwiseQuotient(normals.row(2).replicate(3, 1));
  const auto zero = [](Eigen::Index) { return 0.0; };
  stored.channels.push_back(pack("slope_x", kSlopeBytes, kept.row(0), zero));
  stored.channels.push_back(pack("slope_y", kSlopeBytes, kept.row(1), zero));
  kept = -kept;
}

/// Vertex numbers as little-endian 32-bit numbers.
std::string packed_corners(const SurfaceMesh& mesh) {
  std::vector<unsigned char> bytes;
  for (const int number : mesh.triangles.reshaped()) {
    for (unsigned k = 0; k < 4; ++k) {
      bytes.push_back(static_cast<unsigned char>(static_cast<std::uint32_t>(number) >> (8U * k)));
    }
  }
  return base64(bytes);
}

/// Records the grid's triangulation, or stores the triangles.
void add_triangles(StoredSurface& stored, const SurfaceMesh& mesh) {
  if (mesh.grid.is_grid()) {
    if (mesh.triangles == grid_triangles(mesh.grid)) return;
    stored.zigzag = mesh.triangles == make_grid_mesh({1.0, 1.0}, mesh.grid, 0.0).triangles;
  }
  if (!stored.zigzag) stored.corners = packed_corners(mesh);
}

}  // namespace

double StoredChannel::step() const {
  return bytes == 0 ? 0.0 : (high - low) / (std::ldexp(1.0, 8 * bytes) - 1.0);
}

const StoredChannel* StoredSurface::channel(const std::string& name) const {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const StoredChannel& c) { return c.name == name; });
  return found == channels.end() ? nullptr : &*found;
}

StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const Eigen::Vector2d& lens_size) {
  StoredSurface stored;
  stored.grid = mesh.grid;
  stored.vertices = mesh.vertex_count();
  stored.triangles = mesh.triangle_count();
  stored.read_back.mesh = mesh;
  add_places(stored, lens_size);
  const auto zero = [](Eigen::Index) { return 0.0; };
  stored.channels.push_back(pack("z", kHeightBytes, stored.read_back.mesh.vertices.row(2), zero));
  if (normals.cols() > 0) add_slopes(stored, normals);
  add_triangles(stored, mesh);
  return stored;
}

namespace {

namespace fs = std::filesystem;

/// The picture after a cause of error.
struct CausePicture {
  std::string cause;
  Image picture;  ///< Linear light.
};

/// `cam`'s prediction of the part, for a page.
struct CutForecast {
  /// In order: the surface between the vertices, which the design's picture ignores, polish, …; the
  /// last is the part's.
  std::vector<CausePicture> causes;
  SampledSurface polished;       ///< As designed, but polished.
  SampledSurface part;           ///< Cut and polished.
  std::string leakage_map;       ///< Bytes of a PNG.
  std::vector<ReportPath> path;  ///< Finishing paths; empty for a mould, which has another frame.
  std::string note;              ///< Reason for which a cut has none; else empty.

  [[nodiscard]] bool empty() const { return causes.empty(); }
};

/// Maximum size of report.json, which has about 30 kB.
constexpr std::uintmax_t kMaxReportBytes = std::uintmax_t{16} << 20U;
/// Maximum size of leakage.png.
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

/// Reads the forecast from a lens folder; empty where there is no prediction.
/// @throw InputError naming the file if it cannot be read or is of another lens; Interrupted.
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

/// Nodes of a spline at most: more would not fit a page of 25 MB.
constexpr double kMaxNodes = 480e3;
/// Samples of a height map, 4 bytes each in a page.
constexpr std::size_t kMaxHeights = 1'000'000;

/// The surface with the normals that send its light: none of facets.
SampledSurface surface_of(const Lens& lens) {
  if (lens.spline) {
    const auto cells = static_cast<double>(lens.spline->cell_count());
    return spline_nodes(*lens.spline, samples_for(kMaxNodes, cells));
  }
  if (lens.model == SurfaceModel::kFacet) return {lens.surface, {}};
  return {lens.surface, vertex_area_normals(lens.surface)};
}

/// The picture of a surface as stored against the program's own.
double storage_error(const SampledSurface& stored, const OpticalSetup& setup, const Image& target,
                     const Image& picture, const Executor& executor) {
  Image drawn;
  if (stored.normals.cols() > 0) {
    evaluate(stored.mesh, stored.normals, setup, target, &drawn, executor);
  } else {
    evaluate(stored.mesh, setup, SurfaceModel::kFacet, target, &drawn, executor);
  }
  return compare(drawn, picture).mae;
}

/// @throw InputError if a height map would not fit a page of 25 MB beside the surfaces.
void require_small_front(const OpticalSetup& setup, const std::string& name) {
  const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
  if (map == nullptr || map->spline->coefficients().size() <= kMaxHeights) return;
  throw InputError(name + ": its front has more than " + std::to_string(kMaxHeights) +
                   " samples, too many for a page; render draws its picture");
}

/// A surface with the picture that the program has of it.
ViewedSurface viewed(const std::string& id, const std::string& words, const SampledSurface& surface,
                     Image picture, const Lens& lens, const Executor& executor) {
  ViewedSurface result{id, words, {}, std::move(picture), 0.0};
  result.surface = store_surface(surface.mesh, surface.normals, lens.setup.lens_size);
  result.storage_error =
      storage_error(result.surface.read_back, lens.setup, lens.target, result.picture, executor);
  return result;
}

/// Adds the surfaces of a part, and what each cause makes of the picture.
void add_forecast(const fs::path& folder, const Lens& lens, const Executor& executor,
                  const RunControl& control, LensView& view) {
  CutForecast forecast = read_forecast(folder, lens, control);
  if (!forecast.note.empty()) {
    view.notes.push_back((folder / lens_file::kCut).string() + ": " + forecast.note);
  }
  if (forecast.empty()) return;
  view.surfaces.push_back(viewed("polished", "only polished", forecast.polished,
                                 forecast.causes[1].picture, lens, executor));
  view.surfaces.push_back(viewed("part", "cut and polished", forecast.part,
                                 forecast.causes.back().picture, lens, executor));
  for (CausePicture& cause : forecast.causes) {
    view.causes.push_back({std::move(cause.cause), "", std::move(cause.picture)});
  }
  view.causes[2].surface = "polished";
  view.causes.back().surface = "part";
  view.path = std::move(forecast.path);
  view.leakage_map = std::move(forecast.leakage_map);
}

LensRaster relief_of(const Lens& lens) {
  const auto surface = optical_surface(lens, lens.model);
  const Eigen::Vector2d size = lens.setup.lens_size;
  const Eigen::Vector2d nodes = (kReliefNodes - 1) * size / size.maxCoeff();
  LensRaster raster{static_cast<int>(std::lround(nodes.x())) + 1,
                    static_cast<int>(std::lround(nodes.y())) + 1,
                    {}};
  for (int row = 0; row < raster.rows; ++row) {
    for (int column = 0; column < raster.columns; ++column) {
      const Eigen::Vector2d share(column / std::max(1.0, raster.columns - 1.0),
                                  row / std::max(1.0, raster.rows - 1.0));
      const auto point = surface->at(nearest_inside(surface->box(), size.cwiseProduct(share)));
      raster.values.push_back(point ? static_cast<float>(point->z) : 0.0F);
    }
  }
  return raster;
}

}  // namespace

LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor) {
  require_small_front(lens.setup, name);
  LensView view;
  view.name = name;
  view.setup = lens.setup;
  view.model = model_name(lens.model);
  view.target = lens.target;
  view.surfaces.push_back(
      viewed("designed", "as designed", surface_of(lens), lens.render, lens, executor));
  view.causes.push_back({"the design", "designed", lens.render});
  view.relief = relief_of(lens);
  return view;
}

LensView read_view(const fs::path& folder, const Executor& executor, const RunControl& control) {
  const Lens lens = read_lens(folder);
  if (lens.render.empty()) {
    throw InputError(folder.string() + ": holds no " + lens_file::kRenderExr +
                     ", the picture that the lens projects; design it again");
  }
  control.report({"picture", 0.0, 0.0, ""});
  LensView view = view_of_lens(lens, fs::weakly_canonical(folder).filename().string(), executor);
  add_forecast(folder, lens, executor, control, view);
  if (control.stop_requested()) throw Interrupted();
  return view;
}

}  // namespace lensforge
