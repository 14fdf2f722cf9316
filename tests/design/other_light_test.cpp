// SPDX-License-Identifier: GPL-3.0-or-later
// Light of other kinds than parallel light along +z goes through transport, objective, optimisation
// and rendering without a word of theirs about it: LightPath answers.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/optics/light_path.h"
#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/render.h"
#include "design/schedule/face_transport.h"
#include "design/schedule/guided_optimization.h"
#include "design/snell.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

using testing::Random;

constexpr double kThickness = 5.0;  ///< mm

/// A kind of light and a screen for it.
struct KindOfLight {
  const char* name;
  void (*apply)(OpticalSetup&);
};

void light_from_the_side(OpticalSetup& setup) {
  setup.lamp = ParallelLight{Eigen::Vector3d(0.25, -0.15, 1.0).normalized()};
}
void turn_screen(OpticalSetup& setup) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  setup.screen_x = turn.col(0);
  setup.screen_y = turn.col(1);
}
void large_turned_screen(OpticalSetup& setup) {
  turn_screen(setup);
  setup.image_size *= 1.3;
}
void point_source(OpticalSetup& setup) {
  setup.lamp = PointSource{{0.5 * setup.lens_size.x() + 5.0, 0.5 * setup.lens_size.y(), -150.0},
                           Emission::kLambertian};
}
void mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{Eigen::Vector3d(0.5, 0.0, -std::sqrt(0.75))};
}
void lit_mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = PointSource{{-90.0, 0.5 * setup.lens_size.y(), 150.0}, Emission::kIsotropic};
}

void convex_front(OpticalSetup& setup) { setup.front = spherical_front(120.0, setup.lens_size); }
void point_concave_front(OpticalSetup& setup) {
  point_source(setup);
  setup.front = spherical_front(-120.0, setup.lens_size);
}

/// Waves of a front, 0.25 mm high, and their normal, towards the inside.
double wave(const Eigen::Vector2d& at) {
  return -0.25 + 0.25 * std::sin(0.3 * at.x()) * std::cos(0.25 * at.y() + 0.3);
}
Eigen::Vector3d wave_normal(const Eigen::Vector2d& at) {
  const double by_x = 0.075 * std::cos(0.3 * at.x()) * std::cos(0.25 * at.y() + 0.3);
  const double by_y = -0.0625 * std::sin(0.3 * at.x()) * std::sin(0.25 * at.y() + 0.3);
  return Eigen::Vector3d(-by_x, -by_y, 1.0).normalized();
}
void wavy_front(OpticalSetup& setup) {
  setup.front = testing::height_front(setup.lens_size, {49, 41}, wave);
}
void point_wavy_front(OpticalSetup& setup) {
  point_source(setup);
  wavy_front(setup);
}

/// The same lens in another light, its picture moved to where that goes.
OpticalSetup lit_by(const KindOfLight& kind, OpticalSetup setup) {
  kind.apply(setup);
  const Eigen::Vector2d middle =
      0.5 * setup.lens_size + (setup.focal_length - 5.0) * LightPath(setup).chief_slope(5.0);
  setup.image_origin = middle - 0.5 * setup.image_size;
  return setup;
}

void reflecting_faces(OpticalSetup& setup) { setup.fresnel = true; }

constexpr KindOfLight kKinds[] = {{"ReflectingFaces", reflecting_faces},
                                  {"Oblique", light_from_the_side},
                                  {"TurnedScreen", large_turned_screen},
                                  {"Point", point_source},
                                  {"Mirror", mirror},
                                  {"PointOnMirror", lit_mirror},
                                  {"ConvexFront", convex_front},
                                  {"PointConcaveFront", point_concave_front},
                                  {"WavyFront", wavy_front},
                                  {"PointWavyFront", point_wavy_front}};

using Case = std::tuple<KindOfLight, SurfaceModel>;

class OtherLight : public ::testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] static const KindOfLight& kind() { return std::get<0>(GetParam()); }
  [[nodiscard]] static SurfaceModel model() { return std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(Kinds, OtherLight,
                         ::testing::Combine(::testing::ValuesIn(kKinds),
                                            ::testing::ValuesIn(testing::kModels)),
                         [](const auto& one) {
                           return std::get<0>(one.param).name + std::string("_") +
                                  model_name(std::get<1>(one.param));
                         });

/// Transport's targets for the light of the start's faces. Fits the mesh to them.
Correspondence transport(const OpticalSetup& setup, SurfaceModel model, const Image& target,
                         SurfaceMesh& mesh) {
  const Executor executor = Executor::cpu(2);
  const FaceLight even = face_light(mesh, setup, model, executor);
  const TransportResult result = transport_faces(even, target, {}, executor, RunControl());
  const Eigen::VectorXd served = favour_dark({mesh, result.lit_areas}, setup);
  const SurfaceMesh flat = mesh;
  EXPECT_TRUE(spread_vertices({flat, served}, 0.7, setup, executor, RunControl(), mesh));
  const BrenierMap map(even.sites, result, target);
  align_to_creases(map, setup, mesh);
  shape_start(setup, kThickness, executor, mesh);
  const FaceLight light = face_light(mesh, setup, model, executor);
  return {map_faces(light, map, executor), light.flux};
}

/// Metrics of a small lens designed for `setup`.
ImageMetrics designed(const OpticalSetup& setup, SurfaceModel model) {
  const Image target = testing::spot_picture(setup.pixels.x(), setup.pixels.y());
  const Executor executor = Executor::cpu(2);
  SurfaceMesh mesh = start_surface(setup, {41, 47}, kThickness, executor);
  const Correspondence wanted = transport(setup, model, target, mesh);
  aim_surface(wanted, setup, kThickness, executor, mesh);
  ObjectiveOptions options;
  options.model = model;
  options.weights.smooth = default_smoothness(model);
  options.nu = 3.0 * 40.0 / setup.pixels.x() / LightPath(setup).reach(1.0);
  options.area = default_area_barrier(setup, mesh.triangle_count());
  GuidedOptimization stage(mesh, setup, target, options, executor);
  LbfgsOptions optimizer;
  optimizer.max_iterations = 100;
  const LbfgsSummary summary = stage.run(
      optimizer, [](int, const ObjectiveEvaluation&) { return true; }, mesh);
  EXPECT_NE(summary.status, LbfgsSummary::Status::kInfeasibleStart) << summary.message;
  return evaluate(mesh, setup, model, target, nullptr, executor);
}

TEST_P(OtherLight, DesignsConvergeAsThoseForLightAlongZ) {
  const OpticalSetup straight = testing::setup_of({25.0, 25.0}, {32, 32}, 100.0);
  const ImageMetrics other = designed(lit_by(kind(), straight), model());
  RecordProperty("mae", std::to_string(other.mae));
  RecordProperty("flux_inside", std::to_string(other.flux_inside));
  // Light along z: below 0.001 with both models.
  EXPECT_LT(other.mae, 0.003);
  EXPECT_GT(other.flux_inside, 0.99);
}

TEST_P(OtherLight, ObjectiveGradientEqualsCentralDifferences) {
  const OpticalSetup setup = lit_by(kind(), testing::kSetup);
  const SurfaceMesh mesh = testing::rough_mesh();
  DesignObjective objective(mesh, setup, testing::target(), testing::options_of(model(), {}),
                            Executor::serial());
  EXPECT_LT(testing::gradient_error(objective, mesh.vertices), 1e-6);
}

/// Not for every corner of every triangle.
TEST(CurvedFront, EveryVertexsRayIsSolvedForOnceAnEvaluation) {
  KernelProfile profile;
  const SurfaceMesh mesh = testing::rough_mesh();
  OpticalSetup setup = testing::kSetup;
  for (const SurfaceModel model : testing::kModels) {
    for (const bool curved : {true, false}) {
      setup.front.reset();
      if (curved) convex_front(setup);
      DesignObjective objective(mesh, setup, testing::target(),
                                testing::options_of(model, ObjectiveWeights()),
                                Executor::serial().with_profile(&profile));
      profile.clear();
      EXPECT_TRUE(testing::evaluate_at(objective, mesh.vertices).feasible);
      const auto entries = profile.entries();
      const auto found = entries.find("incident rays");
      EXPECT_EQ(found == entries.end() ? 0 : found->second.calls, curved ? 1 : 0);
    }
  }
}

/// Intersection of a ray's line with a triangle, on either side of its origin.
std::optional<double> hit(const Corners& t, const Eigen::Vector3d& origin,
                          const Eigen::Vector3d& a) {
  Eigen::Matrix3d sides;
  sides << t.v1 - t.v0, t.v2 - t.v0, -a;
  const Eigen::Vector3d s = sides.inverse() * (origin - t.v0);
  if (s.x() < 0.0 || s.y() < 0.0 || s.x() + s.y() > 1.0) return std::nullopt;
  return s.z();
}

/// A place where rays enter, and the normal there, towards the inside: of a sphere around its
/// centre, of waves, or z = 0.
struct FrontPlace {
  Eigen::Vector3d place;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

FrontPlace front_place(const OpticalSetup& setup, double x, double y) {
  if (!setup.front) return {{x, y, 0.0}};
  if (std::holds_alternative<HeightFront>(*setup.front)) {
    return {{x, y, wave({x, y})}, wave_normal({x, y})};
  }
  const auto& sphere = std::get<SphericalFront>(*setup.front);
  const double radius = sphere.radius;
  const Eigen::Vector3d centre = sphere.apex + radius * Eigen::Vector3d::UnitZ();
  const double across = (Eigen::Vector2d(x, y) - centre.head<2>()).norm();
  const double rise = std::copysign(std::sqrt(radius * radius - across * across), radius);
  const Eigen::Vector3d place(x, y, centre.z() - rise);
  return {place, (centre - place) / radius};
}

/// A ray that reaches the front, and its light if all rays have the same share of the plan.
struct SourceRay {
  Eigen::Vector3d way;
  double light;
};

SourceRay source_ray(const OpticalSetup& setup, const FrontPlace& front) {
  const Eigen::Vector3d across = front.normal / front.normal.z();
  if (const auto* const parallel = std::get_if<ParallelLight>(&setup.lamp)) {
    return {parallel->direction, across.dot(parallel->direction) / parallel->direction.z()};
  }
  const auto& lamp = std::get<PointSource>(setup.lamp);
  const Eigen::Vector3d from = front.place - lamp.position;
  const Eigen::Vector3d way = from.normalized();
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
  const bool even = lamp.emission == Emission::kIsotropic;
  const double intensity = even ? 1.0 : way.dot((middle - lamp.position).normalized());
  return {way, intensity * std::abs(across.dot(way)) / from.squaredNorm()};
}

/// Intersection of a ray with a surface.
struct Meeting {
  Eigen::Vector3d place;
  Eigen::Vector3d normal;
  Eigen::Index face = 0;
};

/// A mesh whose facets are flat.
class FlatFacets {
 public:
  explicit FlatFacets(const SurfaceMesh& mesh) : mesh_(mesh) {}

  [[nodiscard]] std::optional<Meeting> meet(const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& way) const {
    for (Eigen::Index f = 0; f < mesh_.triangles.cols(); ++f) {
      const Corners t = mesh_.corners(f);
      const std::optional<double> length = hit(t, from, way);
      if (length) return Meeting{from + *length * way, area_normal(t).normalized(), f};
    }
    return std::nullopt;
  }
  [[nodiscard]] bool is_met_again(const Meeting& met, const Eigen::Vector3d& way) const {
    for (Eigen::Index f = 0; f < mesh_.triangles.cols(); ++f) {
      if (f != met.face && hit(mesh_.corners(f), met.place, way).value_or(0.0) > 1e-9) return true;
    }
    return false;
  }

 private:
  const SurfaceMesh& mesh_;
};

/// The smooth surface z = 5 + 0.15 sin(0.4 x) cos(0.3 y) itself over 24 mm × 20 mm.
struct Waves {
  static double height(double x, double y) {
    return 5.0 + 0.15 * std::sin(0.4 * x) * std::cos(0.3 * y);
  }
  [[nodiscard]] static std::optional<Meeting> meet(const Eigen::Vector3d& from,
                                                   const Eigen::Vector3d& way) {
    Eigen::Vector3d p = from;
    for (int k = 0; k < 40; ++k) p += (height(p.x(), p.y()) - p.z()) / way.z() * way;
    if (p.x() < 0.0 || p.y() < 0.0 || p.x() > 24.0 || p.y() > 20.0) return std::nullopt;
    const double by_x = 0.06 * std::cos(0.4 * p.x()) * std::cos(0.3 * p.y());
    const double by_y = -0.045 * std::sin(0.4 * p.x()) * std::sin(0.3 * p.y());
    return Meeting{p, Eigen::Vector3d(-by_x, -by_y, 1.0).normalized()};
  }
  [[nodiscard]] static bool is_met_again(const Meeting& met, const Eigen::Vector3d& way) {
    for (int k = 1; k <= 100; ++k) {
      const Eigen::Vector3d p = met.place + 0.01 * k / way.z() * way;
      const bool above_lens = p.x() > 0.0 && p.y() > 0.0 && p.x() < 24.0 && p.y() < 20.0;
      if (above_lens && p.z() < height(p.x(), p.y())) return true;
    }
    return false;
  }
};

struct TracedPicture {
  std::vector<double> flux;
  double whole = 0.0;
  double squares = 0.0;  ///< Sum of the squares of what the rays stand for.
  int shadowed = 0;      ///< Rays that meet the surface a second time.
};

/// Flux per pixel by single rays, apart from LightPath: they enter the front and are refracted by
/// angles, or go straight on, meet the surface, and are refracted or reflected there.
template <class Surface>
TracedPicture traced(const Surface& surface, const OpticalSetup& setup, int rays) {
  const bool lens = traits(setup.body).transmits;
  const Eigen::Vector3d normal = setup.screen_x.cross(setup.screen_y);
  const ImagePlane plane(setup);
  TracedPicture picture;
  picture.flux.assign(static_cast<std::size_t>(setup.pixels.prod()), 0.0);
  Random random(9);
  const double margin = 5.0;  // mm; the surface is lit from beside its own place, too.
  for (int ray = 0; ray < rays; ++ray) {
    const double x = random.between(-margin, setup.lens_size.x() + margin);
    const double y = random.between(-margin, setup.lens_size.y() + margin);
    const FrontPlace front = front_place(setup, x, y);
    const Eigen::Vector3d& place = front.place;
    const SourceRay source = source_ray(setup, front);
    const Eigen::Vector3d a =
        lens ? testing::refract_by_angles(source.way, front.normal, 1.0 / setup.ior) : source.way;
    const std::optional<Meeting> met = surface.meet(place, a);
    if (!met) continue;
    picture.whole += source.light;
    picture.squares += source.light * source.light;
    const Eigen::Vector3d& n = met->normal;
    const Eigen::Vector3d b = lens ? testing::refract_by_angles(a, n, setup.ior)
                                   : Eigen::Vector3d(a - 2.0 * n.dot(a) * n);
    if (surface.is_met_again(*met, b)) ++picture.shadowed;
    const Eigen::Vector3d to_centre = setup.screen_centre() - met->place;
    const Eigen::Vector3d l = normal.dot(to_centre) / normal.dot(b) * b - to_centre;
    const Eigen::Vector2d u =
        plane.to_pixels(setup.screen_centre().head<2>() +
                        Eigen::Vector2d(setup.screen_x.dot(l), setup.screen_y.dot(l)));
    if (u.minCoeff() < 0.0 || u.x() >= plane.columns() || u.y() >= plane.rows()) continue;
    picture.flux[static_cast<std::size_t>(static_cast<int>(u.y()) * plane.columns() +
                                          static_cast<int>(u.x()))] += source.light;
  }
  return picture;
}

class OtherRays : public ::testing::TestWithParam<KindOfLight> {};

INSTANTIATE_TEST_SUITE_P(Kinds, OtherRays, ::testing::ValuesIn(kKinds),
                         [](const auto& one) -> std::string { return one.param.name; });

/// The picture is that of the rays within their error bars.
void expect_picture_of(const TracedPicture& rays, const RenderResult& rendered) {
  EXPECT_EQ(rays.shadowed, 0);
  double chi_square = 0.0;
  for (std::size_t i = 0; i < rays.flux.size(); ++i) {
    const double expected =
        static_cast<double>(rendered.image.values()[i]) / static_cast<double>(rays.flux.size());
    const double difference = rays.flux[i] / rays.whole - expected;
    const double variance = expected * rays.squares / (rays.whole * rays.whole);
    chi_square += difference * difference / std::max(variance, 1e-12);
  }
  // 120 pixels: mean 120, five standard deviations of 15.5 above it.
  EXPECT_LT(chi_square, 200.0);
  EXPECT_GT(chi_square, 60.0);
}

TEST_P(OtherRays, FacetPictureIsThatOfSingleRays) {
  const OpticalSetup setup = lit_by(GetParam(), testing::setup_of({24.0, 20.0}, {12, 10}, 60.0));
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, {13, 13}, Waves::height);
  expect_picture_of(traced(FlatFacets(mesh), setup, 60000),
                    render_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial()));
}

/// Rays meet the smooth surface that the mesh samples.
TEST_P(OtherRays, SmoothPictureIsThatOfSingleRays) {
  const OpticalSetup setup = lit_by(GetParam(), testing::setup_of({24.0, 20.0}, {12, 10}, 60.0));
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, {97, 93}, Waves::height);
  expect_picture_of(traced(Waves(), setup, 60000),
                    render_surface(mesh, setup, SurfaceModel::kSmooth, Executor::serial()));
}

}  // namespace
}  // namespace lensforge
