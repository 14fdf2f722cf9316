// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/glare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "core/error.h"
#include "core/io/files.h"
#include "core/mesh/mesh_files.h"
#include "core/optics/refraction.h"
#include "core/temp_folder.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/reflect_shape.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using std::numbers::pi;
using ::testing::HasSubstr;

constexpr double kDisc = kSunRadius;

MirrorMaterial metal() { return {"aluminium", {0.96, 6.69}, false}; }
MirrorMaterial glass() { return {"glass-bk7", 1.5168, true}; }

/// A rectangle about the origin that looks along z.
SurfaceMesh plate(double width, double height) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << -0.5 * width, 0.5 * width, 0.5 * width, -0.5 * width,  //
      -0.5 * height, -0.5 * height, 0.5 * height, 0.5 * height,           //
      0.0, 0.0, 0.0, 0.0;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}

/// `count` plane strips of a cylinder about an axis along y, within ±half_angle of its vertex at
/// the origin, which looks along z: hollow for a positive radius.
SurfaceMesh strips(double radius, double half_angle, int count) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 2 * (count + 1));
  mesh.triangles.resize(3, 2 * count);
  for (int i = 0; i <= count; ++i) {
    const double a = half_angle * (2.0 * i / count - 1.0);
    const double size = std::abs(radius);
    const Vector3d p(size * std::sin(a), 0.0, radius * (1.0 - std::cos(a)));
    mesh.vertices.col(2 * i) = p - Vector3d(0.0, 5.0, 0.0);
    mesh.vertices.col(2 * i + 1) = p + Vector3d(0.0, 5.0, 0.0);
    if (i == count) continue;
    mesh.triangles.col(2 * i) << 2 * i, 2 * i + 2, 2 * i + 3;
    mesh.triangles.col(2 * i + 1) << 2 * i, 2 * i + 3, 2 * i + 1;
  }
  return mesh;
}

double gain(const SurfaceMesh& mesh, const Vector3d& place, const Vector3d& sun,
            const MirrorMaterial& material) {
  const RayScene scene(mesh);
  return MirrorView(mesh, scene, place).gain(sun.normalized(), kDisc, material);
}

/// Fresnel's formulas of the house for one face, and of a pane at normal incidence.
TEST(Glare, ReflectanceIsFresnels) {
  MirrorMaterial face = glass();
  face.pane = false;
  for (const double angle : {0.0, 0.4, 0.9, 1.3, 1.5}) {
    const double inside = std::sqrt(1.0 - std::pow(std::sin(angle) / 1.5168, 2));
    EXPECT_NEAR(face.reflectance(std::cos(angle)), 1.0 - transmittance(inside, 1.5168).value,
                1e-12);
  }
  const double one = std::pow(0.5168 / 2.5168, 2);
  EXPECT_NEAR(glass().reflectance(1.0), 2.0 * one / (1.0 + one), 1e-12);
  EXPECT_NEAR(glass().reflectance(0.0), 1.0, 1e-12);
  // ((n − 1)² + k²)/((n + 1)² + k²)
  EXPECT_NEAR(metal().reflectance(1.0), (0.0016 + 44.7561) / (3.8416 + 44.7561), 1e-12);
}

/// A flat mirror shows the sun once: the beam times the reflectance; at its rim, half of that.
TEST(Glare, OfAFlatMirrorIsTheReflectance) {
  for (const MirrorMaterial& material : {metal(), glass()}) {
    for (const double angle : {0.0, 0.5, 1.2}) {
      const double expected = material.reflectance(std::cos(angle));
      const Vector3d place(-7.0 * std::tan(angle) + 0.3, 0.2, 7.0);
      const Vector3d sun(std::tan(angle), 0.0, 1.0);
      EXPECT_NEAR(gain(plate(2.0, 2.0), place, sun, material), expected, 1e-3 * expected);
      EXPECT_NEAR(gain(plate(2.0, 2.0), place + Vector3d(0.7, 0.0, 0.0), sun, material),
                  0.5 * expected, 0.005 * expected);
      EXPECT_EQ(gain(plate(2.0, 2.0), place + Vector3d(1.0, 0.0, 0.0), sun, material), 0.0);
    }
  }
}

/// A mirror that is smaller than the sun's image: the solid angle that it fills of the disc's.
TEST(Glare, OfASmallMirrorFallsWithTheSquareOfTheDistance) {
  const double angle = 0.6;
  for (const double distance : {300.0, 1000.0}) {
    const Vector3d place = distance * Vector3d(-std::sin(angle), 0.0, std::cos(angle));
    const double solid = std::cos(angle) / (distance * distance);
    const double expected =
        metal().reflectance(std::cos(angle)) * solid / (pi * std::pow(std::tan(kDisc), 2));
    EXPECT_NEAR(gain(plate(1.0, 1.0), place, {std::sin(angle), 0.0, std::cos(angle)}, metal()),
                expected, 1e-4 * expected);
  }
}

/// A cylinder of radius ρ that the sun shines on in a plane along its axis: 1/|1 − 2d/ρ| at the
/// distance d from the axis of symmetry's vertex, before the focus; −ρ for a convex one. The sun
/// may stand at any height, d is measured across the cylinder's axis.
TEST(Glare, OfACylinderIsThatOfRays) {
  for (const double radius : {10.0, -10.0}) {
    const SurfaceMesh mesh = strips(radius, 0.15, 3000);
    for (const double height : {0.0, 0.7}) {
      const Vector3d sun(0.0, std::tan(height), 1.0);
      for (const double distance : {1.0, 2.0, 3.0}) {
        const Vector3d place(0.0, -distance * std::tan(height), distance);
        const double expected =
            metal().reflectance(std::cos(height)) / std::abs(1.0 - 2.0 * distance / radius);
        EXPECT_NEAR(gain(mesh, place, sun, metal()), expected, 0.01 * expected)
            << radius << " " << height << " " << distance;
      }
    }
  }
}

/// Nothing is lost: what passes a plane across the reflected beam is what falls on the mirror.
TEST(Glare, KeepsTheEnergy) {
  const double angle = 0.5;
  const Vector3d out(-std::sin(angle), 0.0, std::cos(angle));
  const Vector3d across(std::cos(angle), 0.0, std::sin(angle));
  const SurfaceMesh mesh = plate(1.0, 1.0);
  const RayScene scene(mesh);
  constexpr double kStep = 0.05;
  double sum = 0.0;
  for (double u = -1.0; u < 1.0; u += kStep) {
    for (double v = -1.0; v < 1.0; v += kStep) {
      const MirrorView view(mesh, scene, 40.0 * out + u * across + v * Vector3d::UnitY());
      sum += kStep * kStep * view.gain({std::sin(angle), 0.0, std::cos(angle)}, kDisc, metal());
    }
  }
  const double expected = metal().reflectance(std::cos(angle)) * std::cos(angle);
  EXPECT_NEAR(sum, expected, 0.002 * expected);
}

TEST(Glare, ShadedOrHiddenMirrorsReflectNothing) {
  const Vector3d sun(1.0, 0.0, 1.0);
  const Vector3d place(-3.0, 0.0, 3.0);
  const SurfaceMesh screen = plate(1.0, 1.0);
  for (const Vector3d& at : {Vector3d(2.0, 0.0, 2.0), Vector3d(-2.0, 0.0, 2.0)}) {
    SurfaceMesh mesh = plate(2.0, 2.0);
    mesh.vertices.conservativeResize(3, 8);
    mesh.vertices.rightCols(4) = screen.vertices.colwise() + at;
    mesh.triangles.conservativeResize(3, 4);
    mesh.triangles.rightCols(2) = screen.triangles.colwise().reverse().array() + 4;  // Looks down.
    EXPECT_GT(gain(plate(2.0, 2.0), place, sun, metal()), 0.9);
    EXPECT_EQ(gain(mesh, place, sun, metal()), 0.0);
  }
}

/// The mean of the gain over a ball, by rays from the sun: Σ R · chord · area per ray / volume.
double ball_gain_by_rays(const SurfaceMesh& mesh, const Vector3d& middle, double radius,
                         const Vector3d& sun, const MirrorMaterial& material, int count) {
  const RayScene scene(mesh);
  const Faces faces = measure_faces(mesh);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double half = 0.5 * bounding_diagonal(mesh);
  const Vector3d centre =
      0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff());
  const Vector3d u = sun.unitOrthogonal();
  const Vector3d w = sun.cross(u);
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const double r = std::tan(kDisc) * std::sqrt(share(random));
    const double a = 2.0 * pi * share(random);
    const Vector3d d = -(sun + r * (std::cos(a) * u + std::sin(a) * w)).normalized();
    const Vector3d from =
        centre + half * ((2.0 * share(random) - 1.0) * u + (2.0 * share(random) - 1.0) * w) -
        2.0 * half * d;
    const RayHit hit = scene.nearest(from, d);
    if (!hit.met()) continue;
    const Vector3d n = faces.normal.col(hit.face);
    if (n.dot(d) >= 0.0) continue;
    const Vector3d p = scene.lifted(from + hit.distance * d, n);
    const Vector3d out = d - 2.0 * n.dot(d) * n;
    const double along = out.dot(middle - p);
    const double off2 = (middle - p).squaredNorm() - along * along;
    if (along < 0.0 || off2 >= radius * radius || scene.blocked(p, out, along)) continue;
    sum += material.reflectance(-n.dot(d)) * 2.0 * std::sqrt(radius * radius - off2);
  }
  const double area = 4.0 * half * half / count;
  return sum * area / (4.0 / 3.0 * pi * std::pow(radius, 3));
}

double ball_gain(const SurfaceMesh& mesh, const Vector3d& middle, double radius,
                 const Vector3d& sun, const MirrorMaterial& material, int count) {
  const RayScene scene(mesh);
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  double sum = 0.0;
  for (int i = 0; i < count;) {
    const Vector3d q(share(random), share(random), share(random));
    if (q.squaredNorm() > 1.0) continue;
    sum += MirrorView(mesh, scene, middle + radius * q).gain(sun, kDisc, material);
    ++i;
  }
  return sum / count;
}

/// Walls near their focus, and one whose waves shade each other from a low sun.
TEST(Glare, IsThatOfManyRays) {
  struct Case {
    SurfaceMesh mesh;
    Vector3d place;
    Vector3d sun;
    MirrorMaterial material;
  };
  for (const Case& c :
       {Case{shapes::concave_facade(0.3, 8), {0.1, -0.6, 0.4}, {0.1, -1.0, 0.7}, metal()},
        Case{shapes::concave_facade(0.3, 8), {-0.3, -1.5, 0.2}, {-0.4, -1.0, 0.6}, glass()},
        Case{shapes::sine_facade(0.3, 2, 10), {0.4, -0.9, 0.6}, {1.0, -0.5, 0.2}, metal()}}) {
    const Vector3d sun = c.sun.normalized();
    const double expected = ball_gain_by_rays(c.mesh, c.place, 0.15, sun, c.material, 1500000);
    EXPECT_GT(expected, 0.02);
    EXPECT_NEAR(ball_gain(c.mesh, c.place, 0.15, sun, c.material, 20000), expected,
                0.04 * expected);
  }
}

GlareSetup setup_at(double latitude, double longitude, double zone) {
  GlareSetup setup;
  setup.site = {latitude, longitude, zone};
  setup.material = metal();
  return setup;
}

/// Above a wide level mirror the sun is always seen: the beam times the reflectance.
TEST(Glare, OfAWideLevelMirrorFollowsTheSun) {
  GlareSetup setup = setup_at(40.0, -105.0, -7.0);
  setup.places = Vector3d(0.0, 0.0, 0.01);
  setup.limit = 1e-9;
  const SurfaceMesh mesh = plate(1e3, 1e3);
  const GlareYear year = yearly_glare(mesh, setup, Executor::cpu(2));
  double most = 0.0;
  int minutes = 0;
  for (int minute = 0; minute < kGlareDays * 1440; minute += kGlareMinutes) {
    const SunPosition sun =
        sun_position(setup.site, days_since_2000(kSunYear, 1, 1, minute / 60.0 + 7.0));
    const double expected =
        clear_sky_beam(sun, 3.0) * metal().reflectance(std::sin(sun.apparent()));
    most = std::max(most, expected);
    if (expected > 1e-9) minutes += kGlareMinutes;
  }
  EXPECT_NEAR(year.maximum, most, 1e-3 * most);
  EXPECT_NEAR(year.hours_above_limit, minutes / 60.0, 5.0);
  EXPECT_NEAR(year.hours_above_limit, 4450.0, 60.0);  // Half the year, and what refraction adds.
  EXPECT_EQ(year.maximum, year.hourly.maxCoeff());
  EXPECT_EQ(year.maximum, year.monthly().maxCoeff());
  EXPECT_EQ(year.maximum, year.hourly(year.minute / 60 % 24, year.minute / 1440));
  EXPECT_EQ(year.monthly()(3, 5), 0.0);
  EXPECT_GT(year.monthly()(12, 5), year.monthly()(12, 11));
  setup.limit = 0.0;
  const GlareYear serial = yearly_glare(mesh, setup, Executor::serial());
  EXPECT_TRUE((serial.hourly == year.hourly).all());
  EXPECT_EQ(serial.hours_above_limit, 0.0);
}

TEST(Glare, TellsTheTimeOfTheYear) {
  EXPECT_EQ(glare_time(0), "2025-01-01 00:00");
  EXPECT_EQ(glare_time((31 + 28) * 1440 + 13 * 60 + 5), "2025-03-01 13:05");
  EXPECT_EQ(glare_time(365 * 1440 - 5), "2025-12-31 23:55");
}

ReflectOptions facade_options() {
  ReflectOptions options;
  options.goal = GoalKind::kDeflect;
  options.glare = "51.51,-0.08,0";
  options.place = "0,-0.9,0.1";
  options.split = false;
  return options;
}

TEST(Glare, OfAConcaveFacadeFallsToATenthByDeflecting) {
  ReflectOptions options = facade_options();
  options.rim_updates = 10;
  options.face_updates = 10;
  const Executor executor = Executor::cpu(2);
  const ReflectInput input = prepared_input(shapes::concave_facade(0.3, 14), "wall", options);
  const ReflectResult result = reflect_shape(input, options, executor, RunControl());
  ASSERT_TRUE(result.glare);
  EXPECT_GT(result.glare->before.maximum, 300.0);
  EXPECT_LT(result.glare->after.maximum, 0.1 * result.glare->before.maximum);
  // Not because it turned its back.
  const Faces faces = measure_faces(result.mesh);
  const Vector3d place(0.0, -0.9, 0.1);
  Eigen::Index fronts = 0;
  for (Eigen::Index k = 0; k < faces.count(); ++k) {
    fronts += faces.normal.col(k).dot(place - faces.centroid.col(k)) > 0.0;
  }
  EXPECT_GT(fronts, 0.95 * static_cast<double>(faces.count()));
  EXPECT_LT(result.mean_displacement, 0.05);
}

TEST(Glare, TakesPlacesFromTextsFilesAndMeshes) {
  const TempFolder folder;
  ReflectOptions options = facade_options();
  EXPECT_EQ(make_glare_setup(options).places, Vector3d(0.0, -0.9, 0.1));
  write_whole_file(folder / "places.txt", "# x, y, z\n0,-1,0\n\n 2, -3 ,1\r\n");
  options.place = (folder / "places.txt").string();
  const Eigen::Matrix3Xd places = make_glare_setup(options).places;
  ASSERT_EQ(places.cols(), 2);
  EXPECT_EQ(places.col(1), Vector3d(2.0, -3.0, 1.0));
  EXPECT_EQ(make_light_field(options).goal.from, Vector3d(1.0, -2.0, 0.5));
  const ReflectInput input{plate(1.0, 1.0), false, {}, {}, {}, {}};
  const std::uint64_t before = reflect_fingerprint(input, options);
  write_whole_file(folder / "places.txt", "0,-1,0\n2,-3,2\n");
  EXPECT_NE(reflect_fingerprint(input, options), before);
  write_ply(plate(1.0, 1.0), folder / "ground.ply");
  options.place = (folder / "ground.ply").string();
  EXPECT_EQ(make_glare_setup(options).places.cols(), 4);
}

TEST(Glare, ThePlaceWithTheMostIsNamed) {
  GlareSetup setup = setup_at(51.51, -0.08, 0.0);
  setup.places.resize(3, 2);
  setup.places << 0.0, 0.0, -5.0, -0.6, 0.1, 0.1;
  const SurfaceMesh mesh = shapes::concave_facade(0.3, 10);
  const GlareYear both = yearly_glare(mesh, setup, Executor::cpu(2));
  EXPECT_EQ(both.place, 1);
  setup.places = setup.places.col(1).eval();
  const GlareYear one = yearly_glare(mesh, setup, Executor::cpu(2));
  EXPECT_EQ(both.maximum, one.maximum);
  EXPECT_EQ(both.place_maximum[1], one.maximum);
}

/// In metres and the coordinates of a map.
TEST(Glare, DoesNotDependOnUnitAndOrigin) {
  GlareSetup setup = setup_at(51.51, -0.08, 0.0);
  setup.places = Vector3d(0.0, -0.6, 0.1);
  SurfaceMesh mesh = shapes::concave_facade(0.3, 8);
  const GlareYear near = yearly_glare(mesh, setup, Executor::cpu(2));
  const Vector3d origin(533000.0, 180700.0, 15.0);
  mesh.vertices = (20.0 * mesh.vertices).colwise() + origin;
  setup.places = 20.0 * setup.places + origin;
  EXPECT_NO_THROW(require_glare_places(mesh, setup));
  const GlareYear far = yearly_glare(mesh, setup, Executor::cpu(2));
  EXPECT_LT((far.hourly - near.hourly).abs().maxCoeff(), 1e-3 * near.maximum);
}

TEST(Glare, WestIsWhereTheClockIsLate) {
  const auto zone = [](const std::string& glare) {
    ReflectOptions options = facade_options();
    options.glare = glare;
    return make_glare_setup(options).site.zone;
  };
  EXPECT_EQ(zone("36.11,-115.18"), -8.0);
  EXPECT_EQ(zone("36.11,-115.18,-7"), -7.0);
  EXPECT_FALSE(std::signbit(zone("51.51,-0.08")));
}

TEST(Glare, BadInputIsNamed) {
  const TempFolder folder;
  const auto message = [](auto change) {
    ReflectOptions options = facade_options();
    change(options);
    return message_of<InputError>([&] { validate(options); });
  };
  const auto glare = [&](const std::string& text) {
    return message([&](ReflectOptions& o) { o.glare = text; });
  };
  EXPECT_THAT(glare("91,0"), HasSubstr("--glare 91,0: the latitude 91 must be -90 to 90"));
  EXPECT_THAT(glare("0,181"), HasSubstr("the longitude 181 must be"));
  EXPECT_THAT(glare("0,0,15"), HasSubstr("the time zone 15 must be -12 to 14"));
  EXPECT_THAT(glare("nan,0"), HasSubstr("--glare nan,0: must be 2 finite numbers"));
  EXPECT_THAT(glare("51.5"), HasSubstr("--glare 51.5: must be 2 finite numbers"));
  const auto place = [&](const std::string& text) {
    return message([&](ReflectOptions& o) { o.place = text; });
  };
  EXPECT_THAT(place(""), HasSubstr("--glare: needs a place"));
  EXPECT_THAT(place("0,nan,0"), HasSubstr("--place 0,nan,0: must be 3 finite numbers"));
  EXPECT_THAT(place("none.txt"), HasSubstr("none.txt"));
  const std::string file = (folder / "places.txt").string();
  write_whole_file(file, "# nothing\n");
  EXPECT_THAT(place(file), HasSubstr("has 0 places: must have 1 to 1000"));
  write_whole_file(file, "0,-1,0\n0,inf,0\n");
  EXPECT_THAT(place(file), HasSubstr("places.txt, line 2: 0,inf,0: must be 3 finite numbers"));
  EXPECT_THAT(message([](ReflectOptions& o) { o.glare_material = "steel"; }),
              HasSubstr("--glare-material 'steel': must be aluminium, "));
  EXPECT_THAT(message([](ReflectOptions& o) { o.goal = GoalKind::kLine; }),
              HasSubstr("--goal line has no place"));
  EXPECT_THAT(message([](ReflectOptions& o) {
                o = ReflectOptions();
                o.glare_limit = 500.0;
              }),
              HasSubstr("--glare-limit: is only for --glare"));
  EXPECT_THAT(message([](ReflectOptions& o) { o.turbidity = 0.5; }), HasSubstr("1 to 10"));
}

TEST(Glare, PlacesMustSeeAFront) {
  GlareSetup setup = setup_at(51.51, -0.08, 0.0);
  const auto refused = [&](const SurfaceMesh& mesh, const Vector3d& place) {
    setup.places = place;
    return message_of<InputError>([&] { require_glare_places(mesh, setup); });
  };
  const SurfaceMesh wall = shapes::concave_facade(0.3, 6);
  setup.places = Vector3d(0.0, -1.0, 0.0);
  EXPECT_NO_THROW(require_glare_places(wall, setup));
  EXPECT_THAT(refused(wall, {0.0, 3.0, 0.0}),
              HasSubstr("--place 0,3,0: is inside the mesh or beh"));
  EXPECT_THAT(refused(shapes::cube(2), {0.0, 0.1, 0.0}), HasSubstr("is inside the mesh"));
  EXPECT_THAT(refused(wall, {0.0, -1e9, 0.0}), HasSubstr("too far away"));
  EXPECT_THAT(refused(wall, {0.0, -1e300, 0.0}), HasSubstr("too far away"));
}

TEST(Glare, FilesHaveEveryHour) {
  GlareComparison comparison{setup_at(51.51, -0.08, 0.0), {}, {}};
  comparison.setup.places = Vector3d(0.0, -1.0, 0.0);
  comparison.setup.limit = 500.0;
  for (GlareYear* year : {&comparison.before, &comparison.after}) {
    year->hourly = Eigen::ArrayXXd::Zero(24, kGlareDays);
    year->place_maximum = Eigen::VectorXd::Zero(1);
  }
  comparison.before.hourly(14, 59) = comparison.before.maximum = 1234.5;
  comparison.before.minute = 59 * 1440 + 14 * 60 + 35;
  comparison.before.hours_above_limit = 0.25;
  const std::string csv = glare_csv(comparison);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2 + 8760);
  EXPECT_THAT(csv, HasSubstr("\n3,1,14,1234.5,0\n"));
  const nlohmann::json json = glare_json(comparison);
  EXPECT_EQ(json["before"]["time"], "2025-03-01 14:35");
  EXPECT_EQ(json["before"]["monthly"][2][14], 1234.5);
  EXPECT_EQ(json["before"]["hours_above_limit"], 0.25);
  EXPECT_TRUE(json["after"]["time"].is_null());
  const std::string section = glare_section(comparison);
  for (const char* words : {"before: at most 1234 W/m² (2025-03-01 14:35)", "after: nothing",
                            "above 500 W/m²", "<svg", "#0af"}) {
    EXPECT_THAT(section, HasSubstr(words));
  }
}

}  // namespace
}  // namespace lensforge::reflect
