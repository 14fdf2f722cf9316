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
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "cam/cam.h"
#include "cam/post/program_reader.h"
#include "cam/predict/part_surfaces.h"
#include "cam/report/report_data.h"
#include "cam/report/report_html.h"
#include "core/compute/executor.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image.h"
#include "core/image/rasters.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/lens/setup_json.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/render.h"
#include "machine/gcode.h"
#include "machine/gcode/gcode_dialect.h"
#include "view_files.h"

namespace lensforge {
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
  ControlNet polished;           ///< As designed, but polished.
  ControlNet part;               ///< Cut and polished.
  std::string leakage_map;       ///< Bytes of a PNG.
  std::vector<ReportPath> path;  ///< Finishing paths; empty for a mould, which has another frame.
  std::string note;              ///< Reason for which a cut has none; else empty.

  [[nodiscard]] bool empty() const { return causes.empty(); }
};

/// Maximum size of report.json, which has about 30 kB.
constexpr std::uintmax_t kMaxReportBytes = std::uintmax_t{16} << 20U;
/// Maximum size of a picture that is copied into the page.
constexpr std::uintmax_t kMaxMapBytes = std::uintmax_t{64} << 20U;
/// Between the points of a path that is shown, mm.
constexpr double kPathSpacing = 0.5;

[[noreturn]] void refuse(const fs::path& file, const std::string& rule) {
  throw InputError(file.string() + ": " + rule + "; run cam again");
}

/// Coefficients along a line of heights (HeightSpline) as those of the same spline with fourfold
/// knots at its ends (ControlNet), by its blossom.
void clamp_ends(Eigen::Ref<Eigen::VectorXd, 0, Eigen::InnerStride<>> c) {
  const Eigen::Index n = c.size();
  const double first = (c[0] + 4.0 * c[1] + c[2]) / 6.0;
  const double last = (c[n - 1] + 4.0 * c[n - 2] + c[n - 3]) / 6.0;
  c[1] = (2.0 * c[1] + c[2]) / 3.0;
  c[n - 2] = (2.0 * c[n - 2] + c[n - 3]) / 3.0;
  c[0] = first;
  c[n - 1] = last;
}

/// A surface of part.exr as the spline through its nodes.
ControlNet surface_of(const LayeredImage& layers, const std::string& name,
                      const Eigen::Vector2d& size, const fs::path& file) {
  if (!layers.has(name + ".z")) refuse(file, "has no layer " + name + ".z");
  if (std::min(layers.columns(), layers.rows()) < kMinHeightSamples) refuse(file, "is too small");
  const auto z = layers.layer(name + ".z");
  const HeightSpline spline(HeightGrid{layers.columns(), layers.rows(), {z.begin(), z.end()}});
  const Eigen::Vector2i cells(layers.columns() - 1, layers.rows() - 1);
  ControlNet net{{cells.x() + 3, cells.y() + 3}, {}};
  net.points.resize(3, Eigen::Index{net.shape.columns} * net.shape.rows);
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      net.points.col(Eigen::Index{j} * net.shape.columns + i)
          << size.x() * greville_point(i, cells.x()) / cells.x(),
          size.y() * greville_point(j, cells.y()) / cells.y(), spline.coefficient(i - 1, j - 1);
    }
  }
  Eigen::Map<Eigen::MatrixXd, 0, Eigen::Stride<Eigen::Dynamic, 3>> heights(
      net.points.data() + 2, net.shape.columns, net.shape.rows,
      {Eigen::Index{3} * net.shape.columns, 3});
  for (Eigen::Index j = 0; j < heights.cols(); ++j) clamp_ends(heights.col(j));
  for (Eigen::Index i = 0; i < heights.rows(); ++i) clamp_ends(heights.row(i).transpose());
  return net;
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
  const JsonFields leakage = report.object("leakage");
  for (const nlohmann::json& entry : leakage.at("causes")) {
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

/// Approximate number of nodes that a page draws of a spline, if two per cell are not more.
constexpr double kViewNodes = 480e3;
/// Samples of a height map, 4 bytes each in a page.
constexpr std::size_t kMaxHeights = 1'000'000;

/// The setup of the screen on which a slope moves light by more pixels: of two the farther one, in
/// widths of its picture.
OpticalSetup strictest_setup(const Lens& lens) {
  if (!lens.setup.second) return lens.setup;
  OpticalSetup second = on_second_screen(lens.setup);
  const auto reach = [](const OpticalSetup& s) { return s.focal_length / s.image_size.x(); };
  return reach(second) > reach(lens.setup) ? second : lens.setup;
}

StoredSurface stored_design(const Lens& lens) {
  const OpticalSetup setup = strictest_setup(lens);
  if (lens.spline) {
    const auto cells = static_cast<double>(lens.spline->cell_count());
    return store_spline(*lens.spline, samples_for(kViewNodes, cells), setup);
  }
  if (lens.model == SurfaceModel::kFacet) return store_surface(lens.surface, {}, setup);
  return store_surface(lens.surface, vertex_area_normals(lens.surface), setup);
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

/// @throw InputError if a height map would not fit a page of 15 MB beside the surfaces.
void require_small_front(const OpticalSetup& setup, const std::string& name) {
  const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
  if (map == nullptr || map->spline->coefficients().size() <= kMaxHeights) return;
  throw InputError(name + ": its front has more than " + std::to_string(kMaxHeights) +
                   " samples, too many for a page; render draws its picture");
}

/// The same surface on the second screen. @pre lens.second
Lens on_second(Lens lens) {
  lens.setup = on_second_screen(lens.setup);
  lens.target = lens.second->target;
  lens.render = lens.second->render;
  return lens;
}

/// A surface with the picture that the program has of it.
ViewedSurface viewed(const std::string& id, const std::string& words, StoredSurface stored,
                     Image picture, const Lens& lens, const Executor& executor) {
  ViewedSurface result{id, words, std::move(stored), std::move(picture), 0.0};
  result.storage_error =
      storage_error(result.surface.read_back, lens.setup, lens.target, result.picture, executor);
  result.surface.read_back = {};  // Several hundred megabytes that nothing else needs.
  return result;
}

/// A surface of a part, drawn at its spline's knots.
ViewedSurface viewed_part(const std::string& id, const std::string& words, const ControlNet& net,
                          const Image& picture, const Lens& lens, const Executor& executor) {
  return viewed(id, words, store_spline(net, 1, lens.setup), picture, lens, executor);
}

/// Adds the surfaces of a part, and what each cause makes of the picture.
void add_forecast(const CutForecast& forecast, const Lens& lens, const Executor& executor,
                  LensView& view) {
  view.surfaces.push_back(viewed_part("polished", "only polished", forecast.polished,
                                      forecast.causes[1].picture, lens, executor));
  view.surfaces.push_back(viewed_part("part", "cut and polished", forecast.part,
                                      forecast.causes.back().picture, lens, executor));
  for (const CausePicture& cause : forecast.causes) {
    view.causes.push_back({cause.cause, "", cause.picture});
  }
  view.causes[2].surface = "polished";
  view.causes.back().surface = "part";
  view.path = forecast.path;
  view.leakage_map = forecast.leakage_map;
}

std::string words_of(const OtherLight& light) {
  std::string words;
  if (!light.light.lamp.empty()) words = with_word(words, "--lamp " + light.light.lamp);
  if (!light.material.empty()) words = with_word(words, "--material " + light.material);
  return words;
}

/// Shows a view's surfaces in another light, and nothing that is known only in the lens's own. How
/// well they are stored stays as found in that. @pre the designed surface comes first
void relight(const OtherLight& light, Lens lens, const CutForecast& forecast,
             const Executor& executor, const RunControl& control, LensView& view) {
  put_light(light, lens.setup);
  view.setup = lens.setup;
  view.other_light = words_of(light);
  view.leakage_map.clear();
  for (ViewedSurface& viewed : view.surfaces) {
    if (viewed.id != "designed") {
      lens.spline = viewed.id == "part" ? forecast.part : forecast.polished;
      lens.model = SurfaceModel::kSpline;
    }
    evaluate(lens, lens.model, &viewed.picture, executor, Look::kBrief, control);
    if (view.second && viewed.id == "designed") {
      evaluate(on_second(lens), lens.model, &view.second->picture, executor, Look::kBrief, control);
    }
  }
  std::erase_if(view.causes, [](const ViewedCause& step) { return step.surface.empty(); });
  for (ViewedCause& step : view.causes) {
    const auto shown = std::find_if(view.surfaces.begin(), view.surfaces.end(),
                                    [&](const ViewedSurface& s) { return s.id == step.surface; });
    step.picture = shown->picture;
  }
}

/// Adds the pictures by waves of a lens and of its part, where the folder has them.
void add_waves(const fs::path& folder, const RunControl& control, LensView& view) {
  std::error_code none;
  const auto add = [&](const fs::path& file, const std::string& words) {
    if (fs::exists(file, none)) view.waves.push_back({words, read_whole_file(file, kMaxMapBytes)});
    if (control.stop_requested()) throw Interrupted();
  };
  add(folder / lens_file::kWall, "as designed");
  const fs::path report = folder / lens_file::kCut / cam_file::kReport;
  if (!fs::exists(report, none)) return;
  // Without waves, the part's wall.png is by rays.
  const nlohmann::json document =
      parse_json(read_whole_file(report, kMaxReportBytes), report.string());
  if (document.contains("waves"))
    add(folder / lens_file::kCut / cam_file::kWall, "cut and polished");
}

}  // namespace

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

bool ViewedSurface::exact() const { return storage_error <= kMaxStorageError; }

LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor) {
  require_small_front(lens.setup, name);
  LensView view;
  view.name = name;
  view.setup = lens.setup;
  view.model = model_name(lens.model);
  view.target = lens.target;
  StoredSurface stored = stored_design(lens);
  double second_error = 0.0;
  if (lens.second) {
    const Lens far = on_second(lens);
    view.second = {far.target, far.render};
    second_error = storage_error(stored.read_back, far.setup, far.target, far.render, executor);
  }
  view.surfaces.push_back(
      viewed("designed", "as designed", std::move(stored), lens.render, lens, executor));
  ViewedSurface& designed = view.surfaces.front();
  designed.storage_error = std::max(designed.storage_error, second_error);
  view.causes.push_back({"the design", "designed", lens.render});
  view.relief = relief_of(lens);
  return view;
}

LensView read_view(const fs::path& folder, const OtherLight& light, const Executor& executor,
                   const RunControl& control) {
  const Lens lens = read_lens(folder);
  if (lens.render.empty() || (lens.second && lens.second->render.empty())) {
    throw InputError(folder.string() + ": holds no " +
                     (lens.render.empty() ? lens_file::kRenderExr : lens_file::kSecondRenderExr) +
                     ", the picture that the lens projects; design it again");
  }
  control.report({"picture", 0.0, 0.0, ""});
  const std::string name = fs::weakly_canonical(folder).filename().string();
  const CutForecast forecast = read_forecast(folder, lens, control);
  LensView view = view_of_lens(lens, name, executor);
  if (!forecast.note.empty()) {
    view.notes.push_back((folder / lens_file::kCut).string() + ": " + forecast.note);
  }
  if (!forecast.empty()) add_forecast(forecast, lens, executor, view);
  if (light.none()) {
    add_waves(folder, control, view);
  } else {
    relight(light, lens, forecast, executor, control, view);
  }
  if (control.stop_requested()) throw Interrupted();
  return view;
}

namespace {

using nlohmann::json;

/// Nothing is fetched, whatever names a lens folder contains.
constexpr const char* kPolicy =
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">";

/// Bytes per display-encoded value; error below 1e-5.
constexpr int kPictureBytes = 2;
/// Of a height map's coefficient: a sixteen-millionth of its depth, or of that of a flat one, mm.
constexpr int kCoefficientBytes = 3;
constexpr double kMinDepth = 1e-3;
constexpr int kColors = 256;

/// Puts data into separate elements and keeps their index.
class PageData {
 public:
  [[nodiscard]] const std::string& elements() const { return elements_; }

  std::string add(const std::string& text) {
    std::string id = "data-" + std::to_string(count_++);
    elements_ += data_element(id, "text/plain", text);
    return id;
  }
  json numbers(int bytes, double low, double high, const std::string& text) {
    return {{"bytes", bytes}, {"low", low}, {"high", high}, {"element", add(text)}};
  }
  json channel(const StoredChannel& channel) {
    return {{"name", channel.name}, {"columns", channel.columns}, {"rows", channel.rows},
            {"low", channel.low},   {"step", channel.step},       {"element", add(channel.text)}};
  }
  json picture(const Image& image) {
    const auto values = image.values();
    const double high =
        values.empty() ? 1.0
                       : encode(std::max(1.0F, *std::max_element(values.begin(), values.end())));
    PackedNumbers numbers(kPictureBytes);
    for (const float value : values) numbers.add(encode(value), 0.0, high);
    return {{"columns", image.columns()},
            {"rows", image.rows()},
            {"values", this->numbers(kPictureBytes, 0.0, high, numbers.text())}};
  }
  /// Coefficients of a front that is a height map, else null.
  json front(const OpticalSetup& setup) {
    const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
    if (map == nullptr) return nullptr;
    const std::vector<double>& values = map->spline->coefficients();
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double above = std::max(*high, *low + kMinDepth);
    PackedNumbers numbers(kCoefficientBytes);
    for (const double value : values) numbers.add(value, *low, above);
    return {{"columns", map->spline->grid().columns},
            {"rows", map->spline->grid().rows},
            {"values", this->numbers(kCoefficientBytes, *low, above, numbers.text())}};
  }
  json surface(const ViewedSurface& viewed) {
    const StoredSurface& stored = viewed.surface;
    json channels = json::array();
    for (const StoredChannel& one : stored.channels) channels.push_back(channel(one));
    return {{"id", viewed.id},
            {"words", viewed.words},
            {"exact", viewed.exact()},
            {"error", viewed.storage_error},
            {"spline", stored.spline},
            {"samples", stored.samples},
            {"facets", !stored.spline && stored.channel("slope_x") == nullptr},
            {"columns", stored.grid.columns},
            {"rows", stored.grid.rows},
            {"vertices", stored.vertices},
            {"triangles", stored.triangles},
            {"zigzag", stored.zigzag},
            {"channels", channels}};
  }

 private:
  std::string elements_;
  int count_ = 0;
};

json colors() {
  json all = json::array();
  for (int i = 0; i < kColors; ++i) all.push_back(false_color(i / (kColors - 1.0)));
  return all;
}

/// Everything that the scripts need.
std::string data_of(const LensView& view) {
  PageData data;
  const double pixels = static_cast<double>(view.target.columns()) * view.target.rows();
  json all{{"setup", setup_json(view.setup)},
           {"front", data.front(view.setup)},
           {"abbe", Dispersion{}.abbe},
           {"white", view.target.total() / pixels},
           {"colors", colors()},
           {"target", data.picture(view.target)},
           {"surfaces", json::array()},
           {"chain", json::array()}};
  if (view.second) {
    all["second"] = {{"cause", "the design"},
                     {"white", view.second->target.total() / pixels},
                     {"target", data.picture(view.second->target)},
                     {"picture", data.picture(view.second->picture)}};
  }
  for (const ViewedCause& step : view.causes) {
    all["chain"].push_back({{"cause", step.cause},
                            {"surface", step.surface},
                            {"picture", data.picture(step.picture)}});
  }
  for (const ViewedSurface& viewed : view.surfaces) all["surfaces"].push_back(data.surface(viewed));
  return data.elements() + data_element("light-data", "application/json", script_json(all));
}

std::string picture_figure(const Image& image, const std::string& name, const std::string& words) {
  return element("figure", "",
                 element("div", "class=\"shade\"",
                         "<img src=\"" + png_uri(grey_picture(image)) + "\" alt=\"" +
                             escape_html(name) + "\">") +
                     element("figcaption", "",
                             element("b", "", escape_html(name)) + " " + escape_html(words)));
}

std::string stored_pictures(const LensView& view) {
  std::string html = picture_figure(view.target, "Target", "the picture that was asked for");
  for (const ViewedSurface& viewed : view.surfaces) {
    html += picture_figure(viewed.picture, "Light", viewed.words);
  }
  if (view.second) {
    html += picture_figure(view.second->target, "Second target", "the second picture");
    html +=
        picture_figure(view.second->picture, "Second light", "on the second screen, as designed");
  }
  return html;
}

std::string leakage_figure(const LensView& view) {
  if (view.leakage_map.empty()) return "";
  const std::string& bytes = view.leakage_map;
  const std::vector<unsigned char> png(bytes.begin(), bytes.end());
  return element(
      "figure", "",
      element("div", "class=\"shade\"",
              "<img src=\"data:image/png;base64," + base64(png) + "\" alt=\"Leakage map\">") +
          element("figcaption", "",
                  "<b>Leakage</b> light that the part adds where the design has less, in shares "
                  "of a pixel of an even picture"));
}

std::string nanometre_text(double mm) { return decimal_text(1e6 * mm, 2) + " nm"; }

/// Describes the error of a stored surface.
std::string storage_words(const ViewedSurface& viewed) {
  const StoredSurface& stored = viewed.surface;
  std::string words = count_text(stored.vertices) + " vertices" +
                      (stored.spline ? " of a spline" : "") + ", heights to ± " +
                      nanometre_text(0.5 * stored.channel("z")->step);
  if (const StoredChannel* slope = stored.channel("slope_x")) {
    const double step = std::max(slope->step, stored.channel("slope_y")->step);
    words += ", normals to ± " + decimal_text(1e6 * 0.5 * step, 2) + " µrad";
  }
  return words + ": its picture changes by MAE " + decimal_text(viewed.storage_error, 6);
}

std::string facts(const LensView& view) {
  std::vector<NamedText> facts;
  for (const ViewedSurface& viewed : view.surfaces) {
    facts.push_back({"Surface " + viewed.words, storage_words(viewed)});
  }
  facts.push_back({"What is drawn",
                   "the image triangles of the surface: of each one, every pixel gets the light "
                   "that falls on it; of an extended source, the mean over its points"});
  facts.push_back({"Keys",
                   "Tab moves between controls, arrows change them; on the picture arrows move "
                   "the mark and Shift makes ten pixels of it"});
  if (view.second) {
    facts.push_back(
        {"Between the pictures",
         "the screen's place, size and turn change evenly from the first to the second; "
         "target and difference are those of the nearer one"});
  }
  return html_facts(facts);
}

/// Says which model of light the page has.
std::string model_words(const LensView& view) {
  std::string words = "This page computes light by rays, without diffraction";
  words += view.waves.empty() ? "." : "; the program's pictures by waves are below.";
  return element("p", "class=\"model\"", words);
}

std::string wave_figures(const LensView& view) {
  std::string html;
  for (const WavePicture& wave : view.waves) {
    const std::vector<unsigned char> png(wave.png.begin(), wave.png.end());
    html += element("figure", "",
                    element("div", "class=\"shade\"",
                            "<img data-waves src=\"data:image/png;base64," + base64(png) +
                                "\" alt=\"Picture by waves\">") +
                        element("figcaption", "",
                                "<b>By waves</b> " + escape_html(wave.words) +
                                    ": the program's picture with diffraction; "
                                    "controls do not change it"));
  }
  return html;
}

std::string size_words(const Eigen::Vector2d& size) {
  return decimal_text(size.x(), 0) + " × " + decimal_text(size.y(), 0) + " mm";
}

std::string screen_words(const OpticalSetup& setup) {
  return size_words(setup.image_size) + " at z = " + decimal_text(setup.focal_length, 0) + " mm";
}

std::string header(const LensView& view) {
  const OpticalSetup& setup = view.setup;
  const std::string words =
      capitalised(traits(setup.body).name) + " of " + size_words(setup.lens_size) + ", " +
      view.model + " model, in " + traits(setup.lamp).name + "; picture of " + screen_words(setup) +
      (view.second ? ", the second of " + screen_words(on_second_screen(setup)) : "") +
      (view.other_light.empty() ? "" : "; drawn with " + view.other_light);
  return element("h1", "", escape_html(view.name)) + element("p", "", escape_html(words));
}

/// The lens in three dimensions, as in the cutting report.
std::string lens_section(const LensView& view) {
  ReportData data;
  data.surface = view.relief;
  data.lens_size = view.setup.lens_size;
  data.path = view.path;
  data.path_shown = false;  // It would hide the relief.
  return surface_view_html(data);
}

std::string body(const LensView& view) {
  const std::string pictures = stored_pictures(view);
  const std::array<std::pair<std::string_view, std::string>, 7> values{
      {{"RELIEF", png_uri(relief_picture(view.relief, view.setup.lens_size))},
       {"LEAKAGE", leakage_figure(view)},
       {"MODEL", model_words(view)},
       {"WAVES", wave_figures(view)},
       {"LENS", lens_section(view)},
       {"PICTURES", pictures},
       {"FACTS", facts(view)}}};
  return fill_in(view_files::kBody, values);
}

/// One scope for all of them: nothing of it is seen outside.
std::string script() {
  std::string text = "(function () {\n\"use strict\";\n";
  for (const std::string_view file : view_files::kScripts) text.append(file).append("\n");
  return text + "})();\n" + std::string(surface_view_script());
}

}  // namespace

std::string view_page(const LensView& view) {
  PageContent content;
  content.title = view.name + " – light and lens";
  content.head =
      std::string(kPolicy) + "\n" + element("style", "", "\n" + std::string(view_files::kStyle));
  content.header = header(view);
  content.body = body(view) + data_of(view);
  content.footer = escape_html("Made by " + program_mark());
  content.script = script();
  return html_page(content);
}

}  // namespace lensforge
