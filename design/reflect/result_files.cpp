// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/result_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/color.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/io/checkpoint_file.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/page/drawings.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/reflect/glare.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/light/reflection_energy.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;

/// Two shapes with the same faces in the unit frame: the original and the new one.
struct ShapePair {
  const SurfaceMesh& before;
  const SurfaceMesh& after;
};

/// Radiance shown as white: half of what a mirror-like facet reflects straight back.
constexpr double kWhiteRadiance = 2.0;

constexpr int kViews = 8;
constexpr int kSide = 240;      ///< Pixels of a view.
constexpr double kField = 2.8;  ///< Width that a view shows; the shapes' diagonal is 3.
constexpr double kElevation = 8.0 * std::numbers::pi / 180.0;
constexpr std::array<unsigned char, 3> kBackground{24, 26, 32};

/// A view of the origin from far away.
struct View {
  Vector3d towards;  ///< Towards the eye.
  Vector3d right;
  Vector3d up;

  explicit View(int number) {
    const double azimuth = 2.0 * std::numbers::pi * number / kViews - 0.5 * std::numbers::pi;
    towards = {std::cos(kElevation) * std::cos(azimuth), std::cos(kElevation) * std::sin(azimuth),
               std::sin(kElevation)};
    right = Vector3d::UnitZ().cross(towards).normalized();
    up = towards.cross(right);
  }

  [[nodiscard]] Vector3d origin(int column, int row) const {
    const double step = kField / kSide;
    return kField * towards + (column + 0.5 - 0.5 * kSide) * step * right -
           (row + 0.5 - 0.5 * kSide) * step * up;
  }
};

using Color = std::array<unsigned char, 3>;

/// Returns the colour of a face at the point that a ray hits.
using Shader = std::function<Color(int view, int face, const Vector3d& point)>;

ColorImage canvas(int columns, int rows) {
  ColorImage image{columns * kSide, rows * kSide, {}};
  image.rgb.resize(static_cast<std::size_t>(3) * static_cast<std::size_t>(image.columns) *
                   static_cast<std::size_t>(image.rows));
  return image;
}

/// Draws all views of a mesh side by side into a row of the canvas.
void draw_row(const SurfaceMesh& mesh, int row, const Shader& shade, const Executor& executor,
              ColorImage& image) {
  const RayScene scene(mesh);
  const auto draw_line = [&](std::int64_t line) {
    const auto v = static_cast<int>(line) / kSide;
    const int y = static_cast<int>(line) % kSide;
    const View view(v);
    for (int x = 0; x < kSide; ++x) {
      const Vector3d origin = view.origin(x, y);
      const RayHit hit = scene.nearest(origin, -view.towards);
      const Color color =
          hit.met() ? shade(v, hit.face, origin - hit.distance * view.towards) : kBackground;
      const auto at = static_cast<std::size_t>(3) * (static_cast<std::size_t>(row * kSide + y) *
                                                         static_cast<std::size_t>(image.columns) +
                                                     static_cast<std::size_t>(v * kSide + x));
      std::copy(color.begin(), color.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(at));
    }
  };
  parallel_for(executor, "views", std::int64_t{kViews} * kSide, draw_line, 4);
}

Color grey(double radiance) {
  const double shown = encode(std::clamp(radiance / kWhiteRadiance, 0.0, 1.0));
  const auto level = static_cast<unsigned char>(std::lround(255.0 * shown));
  return {level, level, level};
}

DirectionSet eyes() {
  Eigen::Matrix3Xd towards(3, kViews);
  for (int v = 0; v < kViews; ++v) towards.col(v) = View(v).towards;
  return listed_directions(towards);
}

/// Radiance of every face towards the sensor: a column per view for stealth, else one column.
Eigen::MatrixXd face_radiances(const SurfaceMesh& mesh, const LightField& field,
                               const Executor& executor) {
  const bool stealth = !field.goal.has_place();
  const LightPaths paths(mesh, field.goal, stealth ? eyes() : field.evaluation_directions(),
                         kGatherDirections, executor);
  const ReflectionEnergy energy(paths, Loss::kSquare, executor);
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  Eigen::MatrixXd radiance = Eigen::MatrixXd::Zero(mesh.triangle_count(), stealth ? kViews : 1);
  for (Eigen::Index k = 0; k < radiance.rows(); ++k) {
    const FaceRadiance l = energy.radiance(k, normals);
    for (Eigen::Index d = 0; d < paths.directions().count(); ++d) {
      if (!paths.seen(k, d)) continue;
      const double weight = stealth ? 1.0 : paths.directions().weight[d];
      radiance(k, stealth ? d : 0) += weight * (l.direct[d] + l.indirect[d]);
    }
  }
  return radiance;
}

/// Draws the sensor's view of both shapes from eight directions around the z axis, the original
/// above the new one, all with the same scale: for stealth the light of a lamp beside the eye; for
/// other goals the light that goes to their place, averaged over the sun's positions, on the shape
/// seen from there and around. White is the radiance kWhiteRadiance. @throw Interrupted
ColorImage retroreflection_views(const ShapePair& shapes, const LightField& field,
                                 const Executor& executor) {
  ColorImage image = canvas(kViews, 2);
  int row = 0;
  for (const SurfaceMesh* mesh : {&shapes.before, &shapes.after}) {
    const Eigen::MatrixXd radiance = face_radiances(*mesh, field, executor);
    const auto shade = [&](int view, int face, const Vector3d& /*point*/) {
      return grey(radiance(face, radiance.cols() > 1 ? view : 0));
    };
    draw_row(*mesh, row++, shade, executor, image);
  }
  return image;
}

/// Draws the displacement in false colour from eight directions; the brightest colour is the
/// largest displacement.
ColorImage displacement_views(const ShapePair& shapes, const Executor& executor) {
  const Eigen::RowVectorXd moved =
      (shapes.after.vertices - shapes.before.vertices).colwise().norm();
  const double largest = std::max(moved.maxCoeff(), 1e-12);
  const auto shade = [&](int view, int face, const Vector3d& point) {
    const Eigen::Vector3i v = shapes.after.triangles.col(face);
    const Vector3d a = shapes.after.corner(face, 0);
    const Vector3d e = shapes.after.corner(face, 1) - a;
    const Vector3d f = shapes.after.corner(face, 2) - a;
    const Vector3d n = e.cross(f);
    const double beta = (point - a).cross(f).dot(n) / n.squaredNorm();
    const double gamma = e.cross(point - a).dot(n) / n.squaredNorm();
    const double distance =
        (1.0 - beta - gamma) * moved[v[0]] + beta * moved[v[1]] + gamma * moved[v[2]];
    const double light = 0.35 + 0.65 * std::abs(n.normalized().dot(View(view).towards));
    Color color = false_color(distance / largest);
    for (unsigned char& c : color) c = static_cast<unsigned char>(std::lround(light * c));
    return color;
  };
  ColorImage image = canvas(kViews, 1);
  draw_row(shapes.after, 0, shade, executor, image);
  return image;
}

/// The goal as a heading, what the pictures show, and what an energy measures.
struct GoalWords {
  std::string title;
  std::string view;
  std::string energy;
};

std::string energy_of(const std::string& light) {
  return "Energy of the " + light + ", by the square of its radiance.";
}

GoalWords words_of(const ReflectOptions& options) {
  switch (options.goal) {
    case GoalKind::kPoint:
      return {"Light to a point", "the light that goes to the point",
              energy_of("light at the point")};
    case GoalKind::kLine:
      return {"Light to a line", "the light that goes to the line", energy_of("light at the line")};
    case GoalKind::kDeflect:
      return {"Light away from a point", "the light that still goes to the point",
              energy_of("light at the point")};
    case GoalKind::kRadar:
      return {"No echo for a radar", "what an eye beside a lamp sees",
              "Mean radar cross-section over the sector, m²."};
    case GoalKind::kStealth:
      break;
  }
  return {"No light back", "what an eye beside the lamp sees", energy_of("light that goes back")};
}

std::string badge(bool good, const std::string& text) {
  return element("div", good ? "class=\"verdict good\"" : "class=\"verdict bad\"",
                 escape_html(text));
}

std::string header(const ReflectResult& result, const ReflectOptions& options,
                   const GoalWords& words) {
  const std::string size = count_text(result.mesh.triangle_count()) + " faces, " +
                           std::to_string(result.updates.size()) + " updates in " +
                           duration_text(result.seconds / 60.0);
  const std::string title = element("div", "",
                                    element("h1", "", escape_html("Reflection: " + words.title)) +
                                        element("div", "class=\"soft\"", escape_html(size)));
  if (!result.done()) return title + badge(false, "Interrupted: not finished");
  const bool gained = gained_enough(options.goal, result.before.total, result.after.total);
  if (gained && !result.unmet.empty()) return title + badge(false, "A constraint is broken");
  return title + badge(gained, percent_text(result.after.total / result.before.total) +
                                   " of the energy before");
}

std::string warnings(const ReflectResult& result) {
  if (result.unmet.empty()) return "";
  std::string list;
  for (const std::string& unmet : result.unmet) list += element("li", "", escape_html(unmet));
  return element("div", "class=\"warnings\"", "<b>Not met</b>" + element("ul", "", list));
}

std::string energy_table(const ReflectResult& result) {
  const std::array<TableColumn, 4> columns{
      {{"energy", false}, {"before", true}, {"after", true}, {"share", true}}};
  const auto row = [&](const std::string& name, double before, double after) {
    if (!result.done()) return std::vector<std::string>{name, number_text(before, 4), "–", "–"};
    return std::vector<std::string>{name, number_text(before, 4), number_text(after, 4),
                                    before > 0.0 ? percent_text(after / before) : "–"};
  };
  return html_table(columns, {row("one reflection", result.before.direct, result.after.direct),
                              row("one and two", result.before.total, result.after.total)});
}

std::string moved_table(const ReflectResult& result) {
  const double diagonal = bounding_diagonal(result.reference);
  const auto words = [&](double share) {
    return percent_text(share) + " of the diagonal, " + number_text(share * diagonal, 3);
  };
  const std::array<NamedText, 2> facts{
      {{"vertices moved on average by", words(result.mean_displacement)},
       {"at most by", words(result.max_displacement)}}};
  return html_facts(facts) +
         element("p", "class=\"soft\"", "Lengths are in the units of the mesh.");
}

std::string summary(const ReflectResult& result, const GoalWords& words) {
  const std::string note = element("p", "class=\"soft\"", words.energy);
  return html_section("Energies", element("div", "class=\"columns\"",
                                          element("div", "", energy_table(result) + note) +
                                              element("div", "", moved_table(result))));
}

std::string picture_sections(const ReflectResult& result, const GoalWords& words,
                             const ReflectPictures& pictures) {
  const std::string caption =
      "Above as it came, below the new shape, from eight sides: " + words.view +
      ". All with the same scale.";
  const std::string most =
      number_text(result.max_displacement * bounding_diagonal(result.reference), 3);
  return html_section("Before and after", html_figure(pictures.views, words.view, caption)) +
         html_section("How far it moved",
                      html_figure(pictures.displacement, "displacements",
                                  "Displacement of the surface" + html_scale("0", most)));
}

/// The energy of every update over time, a curve per stage.
std::vector<PlotCurve> stage_curves(const std::vector<ReflectUpdate>& updates) {
  std::vector<PlotCurve> curves;
  for (const ReflectUpdate& update : updates) {
    if (curves.empty() || curves.back().name != update.stage) curves.push_back({update.stage, {}});
    curves.back().points.emplace_back(update.seconds, update.energy);
  }
  return curves;
}

std::string energy_section(const ReflectResult& result) {
  const std::string plot = decade_plot(stage_curves(result.updates), "Energy over time");
  if (plot.empty()) return "";
  return html_section("Energy over time",
                      element("figure", "",
                              plot + element("figcaption", "",
                                             "Energy before every update of the vertices, on its "
                                             "own directions, by stage. Splitting edges changes "
                                             "the faces, not the shape.")));
}

std::string radar_section(const ReflectResult& result) {
  if (!result.radar) return "";
  const RadarComparison& radar = *result.radar;
  const std::string words = "On the horizon at " + numbers_text(radar.ghz) + " GHz, " +
                            polarization_word(radar.polarization) + ": on average " +
                            decimal_text(mean_dbsm(radar.before), 1) + " dBsm before, " +
                            decimal_text(mean_dbsm(radar.after), 1) +
                            " dBsm after; a tenth of the azimuths exceeds " +
                            decimal_text(p90_dbsm(radar.before), 1) + " and " +
                            decimal_text(p90_dbsm(radar.after), 1) + " dBsm.";
  return html_section(
      "Radar cross-section",
      element("figure", "style=\"max-width:34rem\"",
              radar_svg(*result.radar) + element("figcaption", "", escape_html(words))));
}

std::string option_section(const ReflectOptions& options) {
  std::vector<NamedText> facts;
  for (const Field& field : description_of(options)) {
    const nlohmann::json value = json_of(field.get());
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (!text.empty()) facts.push_back({field.name, text});
  }
  const std::size_t half = (facts.size() + 1) / 2;
  const std::span<const NamedText> all(facts);
  return html_section("Options",
                      element("div", "class=\"columns\"",
                              html_facts(all.first(half)) + html_facts(all.subspan(half))));
}

}  // namespace

std::string reflect_report(const ReflectResult& result, const ReflectOptions& options,
                           const ReflectPictures& pictures) {
  const GoalWords words = words_of(options);
  const std::string body =
      joined({warnings(result), summary(result, words), picture_sections(result, words, pictures),
              energy_section(result), radar_section(result),
              result.glare ? glare_section(*result.glare) : "", option_section(options)});
  return html_page({"Reflection: " + words.title, header(result, options, words), body,
                    "surface.ply is the new shape, reference.ply the mesh as it came with the same "
                    "vertices and faces; reflect.json and convergence.csv have all figures.",
                    ""});
}

namespace {

namespace fs = std::filesystem;

/// Maximum size of reflect.json, which has a few kilobytes.
constexpr std::uintmax_t kMaxJsonBytes = 1 << 20;

nlohmann::json energies_json(const Energies& energies) {
  return {{"energy_direct", energies.direct}, {"energy", energies.total}};
}

std::string convergence_text(const ReflectResult& result) {
  std::string text =
      "# " + program_mark() + "\nupdate,stage,energy,mean_displacement,max_displacement,seconds\n";
  for (const ReflectUpdate& row : result.updates) {
    text += std::to_string(row.number) + "," + row.stage;
    for (const double value : {row.energy, row.mean_displacement, row.max_displacement}) {
      text.append(",").append(number_text(value, 9));
    }
    text.append(",").append(decimal_text(row.seconds, 2)).append("\n");
  }
  return text;
}

nlohmann::json options_json(const ReflectOptions& options) {
  nlohmann::json json;
  for (const Field& field : description_of(options)) {
    json[field.name.substr(2)] = json_of(field.get());
  }
  return json;
}

}  // namespace

void require_replaceable_result(const fs::path& folder, bool force) {
  for (const char* name : reflect_file::kAll) require_replaceable("--out", folder / name, force);
}

bool holds_result(const fs::path& folder, std::uint64_t fingerprint) {
  const fs::path path = folder / reflect_file::kJson;
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return false;
  const nlohmann::json json =
      nlohmann::json::parse(read_whole_file(path, kMaxJsonBytes), nullptr, false);
  return json.is_object() && json.value("status", nlohmann::json()) == "done" &&
         json.value("fingerprint", nlohmann::json()) == fingerprint_text(fingerprint);
}

nlohmann::json result_json(const ReflectResult& result, const ReflectOptions& options) {
  nlohmann::json json = {{"format", "lensforge.reflect"},
                         {"version", 1},
                         {"program", program_mark()},
                         {"status", result.done() ? "done" : "interrupted"},
                         {"fingerprint", fingerprint_text(result.fingerprint)},
                         {"goal", options_json(options).at("goal")},
                         {"before", energies_json(result.before)},
                         {"after", result.done() ? energies_json(result.after) : nlohmann::json()},
                         {"faces", result.mesh.triangle_count()},
                         {"vertices", result.mesh.vertex_count()},
                         {"updates", result.updates.size()},
                         {"mean_displacement", result.mean_displacement},
                         {"max_displacement", result.max_displacement},
                         {"seconds", result.seconds},
                         {"warnings", result.unmet},
                         {"options", options_json(options)}};
  if (result.radar) json["radar"] = radar_json(*result.radar);
  if (result.glare) json["glare"] = glare_json(*result.glare);
  return json;
}

std::vector<fs::path> write_result(const ReflectResult& result, const ReflectOptions& options,
                                   const fs::path& folder, const Executor& executor) {
  const UnitFrame frame(result.reference);
  const LightField field = frame.to_unit(make_light_field(options));
  const SurfaceMesh before = frame.to_unit(result.reference);
  const SurfaceMesh after = frame.to_unit(result.mesh);
  PendingFiles files(folder);
  files.add(reflect_file::kSurface, [&](const fs::path& to) { write_ply(result.mesh, to); });
  files.add(reflect_file::kPrint,
            [&](const fs::path& to) { write_stl(result.mesh, program_mark(), to); });
  files.add(reflect_file::kReference, [&](const fs::path& to) { write_ply(result.reference, to); });
  const ReflectPictures pictures{retroreflection_views({before, after}, field, executor),
                                 displacement_views({before, after}, executor)};
  files.add(reflect_file::kViews, [&](const fs::path& to) { write_image(pictures.views, to); });
  files.add(reflect_file::kDisplacement,
            [&](const fs::path& to) { write_image(pictures.displacement, to); });
  files.add(reflect_file::kReport, reflect_report(result, options, pictures));
  if (result.radar) {
    files.add(reflect_file::kRadarTable, radar_csv(*result.radar));
    files.add(reflect_file::kRadarPlot, radar_svg(*result.radar));
  }
  if (result.glare) {
    files.add(reflect_file::kGlareTable, glare_csv(*result.glare));
    files.add(reflect_file::kGlareMap, glare_svg(*result.glare));
  }
  files.add(reflect_file::kConvergence, convergence_text(result));
  files.add(reflect_file::kJson, result_json(result, options).dump(2) + "\n");
  std::vector<fs::path> paths = files.publish();
  // A table, a map or a solid of an earlier run is not of this shape.
  for (const char* name : reflect_file::kAll) {
    std::error_code ignored;
    if (std::find(paths.begin(), paths.end(), folder / name) == paths.end()) {
      fs::remove(folder / name, ignored);
    }
  }
  return paths;
}

}  // namespace lensforge::reflect
