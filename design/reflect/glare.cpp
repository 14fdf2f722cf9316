// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/glare.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image.h"
#include "core/io/files.h"
#include "core/mesh/mesh_files.h"
#include "core/optics/material.h"
#include "core/optics/optical_setup.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/reflect/light/light_field.h"

// Notation
//   P       a place; P' its mirror image behind a face's plane, h the height of P above that plane
//   n       the face's unit normal
//   s       unit vector towards the sun, u and w unit vectors across it
//   d'      from P' through the face: the direction in the sky that P sees mirrored in the face,
//           d' = d + 2hn for d from P to the same point of the face

namespace lensforge::reflect {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

// Materials

namespace {

constexpr const char* kMetal = "aluminium";

/// At 550 nm (D. Y. Smith, E. Shiles and M. Inokuti in Palik's Handbook of Optical Constants of
/// Solids, 1985).
constexpr std::complex<double> kAluminium{0.96, 6.69};

MirrorMaterial mirror_material(const std::string& name) {
  if (name == kMetal) return {name, kAluminium, false};
  const std::vector<std::string> names = mirror_material_names();
  std::error_code ignored;
  if (std::find(names.begin(), names.end(), name) == names.end() &&
      !std::filesystem::exists(name, ignored)) {
    throw InputError("--glare-material '" + printable_line(name) + "': must be " +
                     joined(names, ", ") + ", or a file of wavelengths in µm and indices");
  }
  return {name, material_named(name, "--glare-material").index(kLineD), true};
}

}  // namespace

std::vector<std::string> mirror_material_names() {
  std::vector<std::string> names = material_names();
  names.insert(names.begin(), kMetal);
  return names;
}

double MirrorMaterial::reflectance(double cosine) const {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const std::complex<double> inside = std::sqrt(1.0 - (1.0 - c * c) / (index * index));
  double sum = 0.0;
  for (const double share : {std::norm((c - index * inside) / (c + index * inside)),
                             std::norm((index * c - inside) / (index * c + inside))}) {
    sum += pane ? 2.0 * share / (1.0 + share) : share;
  }
  return 0.5 * sum;
}

// Mirrors

namespace {

/// Sides of the polygon that stands for the sun's disc, of the same area: its border is within
/// 0.2 % of the disc's radius.
constexpr int kSides = 32;

/// Planes through the origin about the disc x² + y² ≤ z², a normal each; inside is negative.
std::vector<Vector3d> disc_planes() {
  const double apothem = std::sqrt(pi / (kSides * std::tan(pi / kSides)));
  std::vector<Vector3d> planes;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * pi * i / kSides;
    planes.emplace_back(std::cos(angle), std::sin(angle), -apothem);
  }
  return planes;
}

/// Part of a unit disc.
struct DiscPart {
  double share = 0.0;
  Vector2d middle{0.0, 0.0};
};

/// Cuts a convex polygon of directions by the plane through the origin with this normal (Sutherland
/// & Hodgman 1974).
void cut(std::vector<Vector3d>& ring, const Vector3d& plane, std::vector<Vector3d>& kept) {
  kept.clear();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector3d& a = ring[i];
    const Vector3d& b = ring[(i + 1) % ring.size()];
    const double to_a = plane.dot(a);
    const double to_b = plane.dot(b);
    if (to_a <= 0.0) kept.push_back(a);
    if ((to_a <= 0.0) != (to_b <= 0.0)) kept.emplace_back((to_b * a - to_a * b) / (to_b - to_a));
  }
  ring.swap(kept);
}

/// The part of the disc x² + y² ≤ z² that a triangle of directions covers.
DiscPart covered_part(std::vector<Vector3d> ring) {
  static const std::vector<Vector3d> planes = disc_planes();
  std::vector<Vector3d> kept;
  for (const Vector3d& plane : planes) {
    cut(ring, plane, kept);
    if (ring.size() < 3) return {};
  }
  double area = 0.0;
  Vector2d moment(0.0, 0.0);
  const Vector2d a = ring[0].hnormalized();
  for (std::size_t i = 2; i < ring.size(); ++i) {
    const Vector2d b = ring[i - 1].hnormalized();
    const Vector2d c = ring[i].hnormalized();
    const double part = 0.5 * std::abs((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x());
    area += part;
    moment += part / 3.0 * (a + b + c);
  }
  if (!(area > 0.0)) return {};
  return {area / pi, moment / area};
}

}  // namespace

MirrorView::MirrorView(const SurfaceMesh& mesh, const RayScene& scene, const Vector3d& place)
    : scene_(scene), place_(place) {
  const Faces faces = measure_faces(mesh);
  for (int face = 0; face < faces.count(); ++face) {
    const Vector3d n = faces.normal.col(face);
    const double height = n.dot(place - faces.centroid.col(face));
    if (!(height > 0.0)) continue;
    const Corners c = mesh.corners(face);
    const Vector3d to_image = 2.0 * height * n - place;
    mirrors_.push_back({n, {c.v0 + to_image, c.v1 + to_image, c.v2 + to_image}, height});
  }
  const auto count = static_cast<Eigen::Index>(mirrors_.size());
  axis_.resize(3, count);
  cosine_.resize(count);
  sine_.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& seen = mirrors_[index_of(k)].seen;
    axis_.col(k) = (seen[0] + seen[1] + seen[2]).normalized();
    double cosine = 1.0;
    for (const Vector3d& corner : seen) {
      cosine = std::min(cosine, corner.normalized().dot(axis_.col(k)));
    }
    cosine_[k] = cosine;
    sine_[k] = std::sqrt(1.0 - cosine * cosine);
  }
}

bool MirrorView::open(const Vector3d& point, const Vector3d& normal, const Vector3d& sun) const {
  /// Faces as near to the place as this share of the way do not hide it: it may lie on one.
  constexpr double kReach = 0.999;
  const Vector3d from = scene_.lifted(point, normal);
  const Vector3d way = place_ - from;
  return !scene_.blocked(from, sun, RayScene::kAnywhere) &&
         !scene_.blocked(from, way.normalized(), kReach * way.norm());
}

double MirrorView::gain(const Mirror& mirror, const Disc& disc,
                        const MirrorMaterial& material) const {
  std::vector<Vector3d> ring;
  for (const Vector3d& seen : mirror.seen) {
    ring.emplace_back(disc.u.dot(seen), disc.w.dot(seen), disc.radius * disc.sun.dot(seen));
  }
  const DiscPart part = covered_part(std::move(ring));
  if (part.share == 0.0) return 0.0;
  const Vector3d mirrored =
      disc.sun + disc.radius * (part.middle.x() * disc.u + part.middle.y() * disc.w);
  const double rise = mirrored.dot(mirror.normal);
  const Vector3d direct = mirrored - 2.0 * rise * mirror.normal;
  if (!open(place_ + mirror.height / rise * direct, mirror.normal, disc.sun)) return 0.0;
  return part.share * material.reflectance(rise / mirrored.norm());
}

double MirrorView::gain(const Vector3d& sun, double radius, const MirrorMaterial& material) const {
  const Vector3d u = sun.unitOrthogonal();
  const Disc disc{sun, u, sun.cross(u), std::tan(radius)};
  const double cosine = std::cos(radius);
  const double sine = std::sin(radius);
  double sum = 0.0;
  for (Eigen::Index k = 0; k < axis_.cols(); ++k) {
    // No farther from the sun than the face's spread and the disc's radius together.
    if (axis_.col(k).dot(sun) < cosine_[k] * cosine - sine_[k] * sine) continue;
    sum += gain(mirrors_[index_of(k)], disc, material);
  }
  return sum;
}

// Setup

namespace {

/// Maximum number of places: at 800 faces each takes a second of one core.
constexpr Eigen::Index kMaxPlaces = 1000;
/// Maximum distance of a place, in diagonals: Embree's rays have single precision.
constexpr double kMaxPlaceDistance = 1e6;

SunSite site_of(const std::string& text) {
  const bool zone = std::count(text.begin(), text.end(), ',') == 2;
  const Eigen::VectorXd numbers = number_list("--glare", text, zone ? 3 : 2);
  const auto require = [&](double value, double least, double most, const char* what) {
    if (value >= least && value <= most) return;
    throw InputError("--glare " + text + ": the " + what + " " + number_text(value) + " must be " +
                     number_text(least) + " to " + number_text(most));
  };
  require(numbers[0], -90.0, 90.0, "latitude");
  require(numbers[1], -180.0, 180.0, "longitude");
  if (zone) require(numbers[2], -12.0, 14.0, "time zone");
  const double longitude_zone = std::round(numbers[1] / 15.0) + 0.0;  // No negative zero.
  return {numbers[0], numbers[1], zone ? numbers[2] : longitude_zone};
}

bool is_mesh_file(const std::string& file) {
  const std::string extension = lower_case(std::filesystem::path(file).extension().string());
  const auto all = {".ply", ".stl", ".obj", ".off"};
  return std::find(all.begin(), all.end(), extension) != all.end();
}

Eigen::Matrix3Xd listed_places(const std::string& file) {
  std::vector<Vector3d> places;
  std::istringstream lines(read_whole_file(file, kMaxPlaceBytes));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string_view words = trimmed(line);
    if (words.empty() || words.front() == '#') continue;
    places.emplace_back(number_list("--place " + file + ", line " + std::to_string(number) + ":",
                                    printable_line(words), 3));
  }
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = places[i];
  return all;
}

Eigen::Matrix3Xd glare_places(const std::string& text) {
  if (text.empty()) {
    throw InputError("--glare: needs a place; --place X,Y,Z or a file of them");
  }
  std::error_code ignored;
  const bool file = std::filesystem::exists(text, ignored);
  if (!file && text.find(',') != std::string::npos) return number_list("--place", text, 3);
  Eigen::Matrix3Xd places = is_mesh_file(text) ? read_mesh(text).vertices : listed_places(text);
  if (places.cols() >= 1 && places.cols() <= kMaxPlaces) return places;
  throw InputError("--place " + text + ": has " + std::to_string(places.cols()) +
                   " places: must have 1 to " + std::to_string(kMaxPlaces) +
                   ", a line X,Y,Z or a vertex of a mesh each");
}

}  // namespace

void require_glare_options(const ReflectOptions& options) {
  if (!options.glare.empty()) return;
  const ReflectOptions usual;
  const char* option = options.glare_limit != usual.glare_limit           ? "--glare-limit"
                       : options.glare_north_deg != usual.glare_north_deg ? "--glare-north"
                       : options.turbidity != usual.turbidity             ? "--glare-turbidity"
                       : options.glare_material != usual.glare_material   ? "--glare-material"
                                                                          : nullptr;
  if (option == nullptr) return;
  throw InputError(std::string(option) + ": is only for --glare LAT,LON; leave it out or add that");
}

GlareSetup make_glare_setup(const ReflectOptions& options) {
  if (options.goal == GoalKind::kLine || options.goal == GoalKind::kRadar) {
    throw InputError(std::string("--glare: --goal ") +
                     (options.goal == GoalKind::kLine ? "line" : "radar") +
                     " has no place for it; must be with stealth, point or deflect");
  }
  GlareSetup setup;
  setup.site = site_of(options.glare);
  setup.bearing = options.glare_north_deg * kDegree;
  setup.turbidity = options.turbidity;
  setup.limit = options.glare_limit;
  setup.material = mirror_material(options.glare_material);
  setup.places = glare_places(options.place);
  return setup;
}

void require_glare_places(const SurfaceMesh& mesh, const GlareSetup& setup) {
  const UnitFrame frame(mesh);
  const SurfaceMesh unit = frame.to_unit(mesh);
  const RayScene scene(unit);
  const Faces faces = measure_faces(unit);
  for (const Vector3d given : setup.places.colwise()) {
    const std::string words = "--place " + number_text(given.x()) + "," + number_text(given.y()) +
                              "," + number_text(given.z());
    const Vector3d place = frame.to_unit(given);
    if (!(place.cwiseAbs().maxCoeff() <= kMaxPlaceDistance * kUnitDiagonal)) {
      throw InputError(words + ": is too far away: must be within 1e6 times the mesh's diagonal");
    }
    bool seen = false;
    for (Eigen::Index face = 0; face < faces.count() && !seen; ++face) {
      const Vector3d n = faces.normal.col(face);
      const Vector3d from = scene.lifted(faces.centroid.col(face), n);
      const Vector3d way = place - from;
      seen = n.dot(way) > 0.0 && !scene.blocked(from, way.normalized(), way.norm());
    }
    if (seen) continue;
    throw InputError(words +
                     ": is inside the mesh or behind it: must be where the front of a face "
                     "is seen");
  }
}

// The year

namespace {

constexpr int kStepsPerHour = 60 / kGlareMinutes;
constexpr Eigen::Index kSunSteps = Eigen::Index{kGlareDays} * 24 * kStepsPerHour;
constexpr std::array<int, 12> kMonthDays{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
constexpr std::array<const char*, 12> kMonths{"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                              "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};

struct CalendarDay {
  int month = 0;  ///< From 0.
  int day = 0;    ///< Of the month, from 0.
};

/// @param day  of the year, from 0.
CalendarDay calendar_day(int day) {
  int month = 0;
  while (day >= kMonthDays[index_of(month)]) day -= kMonthDays[index_of(month++)];
  return {month, day};
}

struct SunStep {
  Vector3d towards{0.0, 0.0, 1.0};
  double beam = 0.0;  ///< W/m²
  double radius = 0.0;
};

SunStep sun_step(const GlareSetup& setup, Eigen::Index step) {
  const double hour = static_cast<double>(step) / kStepsPerHour;
  const double days = days_since_2000(kSunYear, 1, 1, hour - setup.site.zone);
  const SunPosition sun = sun_position(setup.site, days);
  return {sun_vector(sun, setup.bearing), clear_sky_beam(sun, setup.turbidity),
          kSunRadius / sun.distance};
}

}  // namespace

Eigen::ArrayXXd GlareYear::monthly() const {
  Eigen::ArrayXXd months = Eigen::ArrayXXd::Zero(24, 12);
  for (int day = 0; day < kGlareDays; ++day) {
    auto month = months.col(calendar_day(day).month);
    month = month.max(hourly.col(day));
  }
  return months;
}

GlareYear yearly_glare(const SurfaceMesh& mesh, const GlareSetup& setup, const Executor& executor) {
  // Rays have single precision, and a façade may have the coordinates of a map.
  const UnitFrame frame(mesh);
  const SurfaceMesh unit = frame.to_unit(mesh);
  const RayScene scene(unit);
  GlareYear year;
  year.place_maximum.resize(setup.places.cols());
  Eigen::ArrayXd largest = Eigen::ArrayXd::Zero(kSunSteps);
  Eigen::ArrayXd irradiance(kSunSteps);
  std::vector<SunStep> suns(index_of(kSunSteps));
  parallel_for(
      executor, "sun", kSunSteps, [&](std::int64_t i) { suns[index_of(i)] = sun_step(setup, i); },
      64);
  for (Eigen::Index p = 0; p < setup.places.cols(); ++p) {
    const MirrorView view(unit, scene, frame.to_unit(setup.places.col(p)));
    const auto shine = [&](std::int64_t i) {
      const SunStep& sun = suns[index_of(i)];
      irradiance[i] =
          sun.beam > 0.0 ? sun.beam * view.gain(sun.towards, sun.radius, setup.material) : 0.0;
    };
    parallel_for(executor, "glare", kSunSteps, shine, 64);
    Eigen::Index at = 0;
    year.place_maximum[p] = irradiance.maxCoeff(&at);
    if (year.place_maximum[p] > year.maximum) {
      year.maximum = year.place_maximum[p];
      year.minute = static_cast<int>(at) * kGlareMinutes;
      year.place = static_cast<int>(p);
    }
    largest = largest.max(irradiance);
  }
  year.hourly = largest.reshaped(kStepsPerHour, kSunSteps / kStepsPerHour)
                    .colwise()
                    .maxCoeff()
                    .reshaped(24, kGlareDays);
  if (setup.limit > 0.0) {
    year.hours_above_limit = static_cast<double>((largest > setup.limit).count()) / kStepsPerHour;
  }
  return year;
}

GlareComparison compare_glare(const SurfaceMesh& before, const SurfaceMesh& after,
                              const GlareSetup& setup, const Executor& executor) {
  return {setup, yearly_glare(before, setup, executor), yearly_glare(after, setup, executor)};
}

// Files

namespace {

std::string two_digits(int number) {
  std::string text = std::to_string(number);
  return text.insert(0, text.size() < 2 ? 1 : 0, '0');
}

std::string watts(double irradiance) { return number_text(irradiance, 4) + " W/m²"; }

std::string maximum_words(const GlareYear& year) {
  if (year.maximum == 0.0) return "nothing";
  return "at most " + watts(year.maximum) + " (" + glare_time(year.minute) + ")";
}

constexpr double kCell = 18.0;
constexpr double kLeft = 40.0;
constexpr double kTop = 44.0;
constexpr double kMapWidth = kLeft + 24.0 * kCell + 24.0;
constexpr double kMapHeight = kTop + 12.0 * kCell + 28.0;

std::string fill_of(double share) {
  const std::array<unsigned char, 3> c = false_color(share);
  return "fill=\"rgb(" + std::to_string(c[0]) + "," + std::to_string(c[1]) + "," +
         std::to_string(c[2]) + ")\"";
}

/// A map by month and hour with its frame.
/// @param left  of the map. @param top  irradiance of the brightest colour.
void draw_map(SvgWriter& svg, double left, const std::string& title, const GlareYear& year,
              double top, double limit) {
  const Eigen::ArrayXXd monthly = year.monthly();
  svg.text({left + kLeft, 20.0}, "font-weight=\"bold\"", title + ": " + maximum_words(year));
  for (int month = 0; month < 12; ++month) {
    const double y = kTop + month * kCell;
    svg.text({left + kLeft - 6.0, y + 13.0}, "text-anchor=\"end\"", kMonths[index_of(month)]);
    for (int hour = 0; hour < 24; ++hour) {
      const double value = monthly(hour, month);
      const Vector2d corner(left + kLeft + hour * kCell, y);
      svg.rectangle(corner, {kCell, kCell}, fill_of(top > 0.0 ? value / top : 0.0));
      if (limit > 0.0 && value > limit) {
        svg.rectangle(corner + Vector2d(1.5, 1.5), {kCell - 3.0, kCell - 3.0},
                      "fill=\"none\" stroke=\"#0af\" stroke-width=\"2\"");
      }
    }
  }
  for (int hour = 0; hour <= 24; hour += 6) {
    svg.text({left + kLeft + hour * kCell, kTop - 6.0}, "text-anchor=\"middle\"",
             two_digits(hour) + ":00");
  }
}

}  // namespace

std::string glare_time(int minute) {
  const CalendarDay day = calendar_day(minute / (24 * 60));
  return std::to_string(kSunYear) + "-" + two_digits(day.month + 1) + "-" +
         two_digits(day.day + 1) + " " + two_digits(minute / 60 % 24) + ":" +
         two_digits(minute % 60);
}

nlohmann::json glare_json(const GlareSetup& setup, const GlareYear& year) {
  const Vector3d place = setup.places.col(year.place);
  nlohmann::json json = {{"maximum", year.maximum}, {"place", {place.x(), place.y(), place.z()}}};
  json["time"] = year.maximum > 0.0 ? nlohmann::json(glare_time(year.minute)) : nlohmann::json();
  if (setup.limit > 0.0) json["hours_above_limit"] = year.hours_above_limit;
  const Eigen::ArrayXXd monthly = year.monthly();
  json["monthly"] = nlohmann::json::array();
  for (const auto month : monthly.colwise()) {
    json["monthly"].push_back(std::vector<double>(month.begin(), month.end()));
  }
  json["places"] = std::vector<double>(year.place_maximum.begin(), year.place_maximum.end());
  return json;
}

nlohmann::json glare_json(const GlareSetup& setup) {
  nlohmann::json json = {{"latitude", setup.site.latitude},
                         {"longitude", setup.site.longitude},
                         {"zone", setup.site.zone},
                         {"north", setup.bearing / kDegree},
                         {"year", kSunYear},
                         {"material", setup.material.name},
                         {"turbidity", setup.turbidity}};
  if (setup.limit > 0.0) json["limit"] = setup.limit;
  return json;
}

nlohmann::json glare_json(const GlareComparison& comparison) {
  nlohmann::json json = glare_json(comparison.setup);
  json["before"] = glare_json(comparison.setup, comparison.before);
  json["after"] = glare_json(comparison.setup, comparison.after);
  return json;
}

std::string glare_csv(const GlareComparison& comparison) {
  std::string text = "# " + program_mark() + "\nmonth,day,hour,before,after\n";
  for (int day = 0; day < kGlareDays; ++day) {
    const CalendarDay date = calendar_day(day);
    for (int hour = 0; hour < 24; ++hour) {
      text += joined({std::to_string(date.month + 1), ",", std::to_string(date.day + 1), ",",
                      std::to_string(hour), ",",
                      trimmed_decimal(comparison.before.hourly(hour, day), 2), ",",
                      trimmed_decimal(comparison.after.hourly(hour, day), 2), "\n"});
    }
  }
  return text;
}

std::string glare_svg(const GlareComparison& comparison) {
  constexpr int kBarSteps = 32;
  constexpr double kBar = 6.0;
  const double top = std::max(comparison.before.maximum, comparison.after.maximum);
  const double limit = comparison.setup.limit;
  SvgWriter svg(1, SvgWriter::Zeros::kTrimmed, "\n");
  svg.add({"<!-- ", program_mark(), " -->"});
  svg.add({"<rect width=\"100%\" height=\"100%\" fill=\"white\"/>"});
  draw_map(svg, 0.0, "before", comparison.before, top, limit);
  draw_map(svg, kMapWidth, "after", comparison.after, top, limit);
  const double y = kMapHeight - 18.0;
  for (int i = 0; i < kBarSteps; ++i) {
    svg.rectangle({kLeft + i * kBar, y}, {kBar, 10.0}, fill_of((i + 0.5) / kBarSteps));
  }
  svg.text({kLeft - 6.0, y + 9.0}, "text-anchor=\"end\"", "0");
  svg.text({kLeft + kBarSteps * kBar + 6.0, y + 9.0}, "",
           watts(top) + (limit > 0.0 ? "; outlined: above " + watts(limit) : ""));
  const std::string size =
      joined({svg.attribute("width", 2.0 * kMapWidth), " ", svg.attribute("height", kMapHeight),
              " viewBox=\"0 0 ", svg.pair({2.0 * kMapWidth, kMapHeight}, " "), "\""});
  return svg.drawing("xmlns=\"http://www.w3.org/2000/svg\" " + size +
                     " font-family=\"sans-serif\" font-size=\"12\"") +
         "\n";
}

std::string glare_section(const GlareComparison& comparison) {
  const GlareSetup& setup = comparison.setup;
  std::vector<TableColumn> columns{
      {"", false}, {"yearly maximum", true}, {"on", false}, {"at", false}};
  if (setup.limit > 0.0) columns.push_back({"hours a year above " + watts(setup.limit), true});
  const auto row = [&](const std::string& name, const GlareYear& year) {
    const Vector3d place = setup.places.col(year.place);
    std::vector<std::string> cells{name, watts(year.maximum),
                                   year.maximum > 0.0 ? glare_time(year.minute) : "–",
                                   joined({number_text(place.x()), ", ", number_text(place.y()),
                                           ", ", number_text(place.z())})};
    if (setup.limit > 0.0) cells.push_back(decimal_text(year.hours_above_limit, 1));
    return cells;
  };
  const std::string words =
      "Largest irradiance by month and hour. Sunlight that faces of " + setup.material.name +
      " reflect once under a clear sky (Linke turbidity " + number_text(setup.turbidity) +
      ") at latitude " + number_text(setup.site.latitude) + ", longitude " +
      number_text(setup.site.longitude) + "; clocks are " + number_text(setup.site.zone) +
      " h ahead of UTC, +y is " + number_text(setup.bearing / kDegree) + "° clockwise from north.";
  return html_section(
      "Reflected sunlight",
      html_table(columns, {row("before", comparison.before), row("after", comparison.after)}) +
          element("figure", "",
                  glare_svg(comparison) + element("figcaption", "", escape_html(words))));
}

}  // namespace lensforge::reflect
