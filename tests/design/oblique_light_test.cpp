// SPDX-License-Identifier: GPL-3.0-or-later
// Light that does not travel along +z goes through transport, objective, optimisation and rendering
// without a word of theirs about it: LightPath answers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/optics/light_path.h"
#include "design/energy/objective.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/render_lens.h"
#include "design/schedule/crease_alignment.h"
#include "design/schedule/face_transport.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/reach.h"
#include "design/snell.h"
#include "design/transport/vertex_spread.h"

namespace lensforge {
namespace {

using testing::Random;

const Eigen::Vector3d kLight = Eigen::Vector3d(0.25, -0.15, 1.0).normalized();

/// The same lens with light from the side, its picture moved to where the light goes.
OpticalSetup lit_from_the_side(OpticalSetup setup) {
  setup.light = kLight;
  setup.image_origin += (setup.focal_length - 5.0) / kLight.z() * kLight.head<2>();
  return setup;
}

class ObliqueLight : public ::testing::TestWithParam<SurfaceModel> {};

INSTANTIATE_TEST_SUITE_P(Models, ObliqueLight, ::testing::ValuesIn(testing::kModels),
                         testing::model_name);

/// Where the light of a flat mesh's faces is to go, after the mesh has been fitted to it.
Correspondence transport(const OpticalSetup& setup, SurfaceModel model, const Image& target,
                         SurfaceMesh& mesh) {
  const Executor executor = Executor::cpu(2);
  const FaceLight even = face_light(mesh, setup, model, executor);
  const TransportResult result = transport_faces(even, target, {}, executor, RunControl());
  const Eigen::VectorXd served = favour_dark({mesh, result.lit_areas}, setup);
  const SurfaceMesh flat = mesh;
  EXPECT_TRUE(spread_vertices({flat, served}, 0.7, setup, executor, RunControl(), mesh));
  const BrenierMap map(even.landing, result, target);
  align_to_creases(map, setup, mesh);
  const FaceLight light = face_light(mesh, setup, model, executor);
  return {map_faces(light, map, executor), light.flux};
}

/// What a small lens throws that is designed for `setup`.
ImageMetrics designed(const OpticalSetup& setup, SurfaceModel model) {
  const Image target = testing::spot_picture(setup.pixels.x(), setup.pixels.y());
  SurfaceMesh mesh = make_grid_mesh(setup.lens_size, {41, 47}, 5.0);
  const Executor executor = Executor::cpu(2);
  const Correspondence wanted = transport(setup, model, target, mesh);
  aim_surface(wanted, setup, 5.0, executor, mesh);
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

TEST_P(ObliqueLight, DesignsConvergeAsThoseForLightAlongZ) {
  const OpticalSetup straight = testing::setup_of({25.0, 25.0}, {32, 32}, 100.0);
  const ImageMetrics expected = designed(straight, GetParam());
  const ImageMetrics oblique = designed(lit_from_the_side(straight), GetParam());
  RecordProperty("mae_along_z", std::to_string(expected.mae));
  RecordProperty("mae_oblique", std::to_string(oblique.mae));
  RecordProperty("flux_oblique", std::to_string(oblique.flux_inside));
  EXPECT_LT(expected.mae, 0.001);
  // 0.0015 with both models, where 0.994 of the light is on the picture; along z all of it is.
  EXPECT_LT(oblique.mae, 0.003);
  EXPECT_GT(oblique.flux_inside, 0.99);
}

TEST_P(ObliqueLight, ObjectiveGradientEqualsCentralDifferences) {
  const OpticalSetup setup = lit_from_the_side(testing::kSetup);
  const SurfaceMesh mesh = testing::rough_mesh();
  DesignObjective objective(mesh, setup, testing::target(), testing::options_of(GetParam(), {}),
                            Executor::serial());
  Eigen::Matrix3Xd gradient;
  ASSERT_TRUE(objective.evaluate(mesh.vertices, gradient).feasible);
  const auto f = [&](const Eigen::VectorXd& x) {
    return testing::evaluate_at(objective, x.reshaped(3, gradient.cols())).energy.total;
  };
  Random random(3);
  Eigen::Matrix3Xd direction = objective.movable();
  for (double& d : direction.reshaped()) d *= random.between(-1.0, 1.0);
  const Eigen::VectorXd products = gradient.cwiseProduct(direction).reshaped();
  const double scale = std::max(std::fabs(products.sum()), products.norm());
  std::vector<double> errors;
  for (const double step : {1e-4, 1e-5, 2e-6, 5e-7, 1e-7}) {
    const double slope =
        testing::directional_slope(f, mesh.vertices.reshaped(), direction.reshaped(), step);
    errors.push_back(std::fabs(slope - products.sum()) / scale);
  }
  EXPECT_LT(testing::plateau_error(errors), 1e-6);
}

/// Share of the way along origin + s a at which a ray meets a triangle, and with which weights of
/// its corners.
struct Hit {
  Eigen::Vector3d place;
  Eigen::Vector3d weights;
};

std::optional<Hit> hit(const Corners& t, const Eigen::Vector3d& origin, const Eigen::Vector3d& a) {
  Eigen::Matrix3d sides;
  sides << t.v1 - t.v0, t.v2 - t.v0, -a;
  const Eigen::Vector3d s = sides.inverse() * (origin - t.v0);
  const Eigen::Vector3d weights(1.0 - s.x() - s.y(), s.x(), s.y());
  if (weights.minCoeff() < 0.0) return std::nullopt;
  return Hit{origin + s.z() * a, weights};
}

/// Flux per pixel by single rays: they enter the flat face and are refracted by angles, meet a
/// facet and are refracted again.
std::vector<double> traced_flux(const SurfaceMesh& mesh, const OpticalSetup& setup, int rays) {
  const Eigen::Vector3d inside =
      testing::refract_by_angles(setup.light, Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
  const ImagePlane plane(setup);
  std::vector<double> flux(static_cast<std::size_t>(setup.pixels.prod()), 0.0);
  Random random(9);
  const double margin = 2.0;  // mm; the surface is lit from beside its own place, too.
  const Eigen::Vector2d range = setup.lens_size.array() + 2.0 * margin;
  for (int ray = 0; ray < rays; ++ray) {
    const Eigen::Vector3d origin(random.between(0.0, range.x()) - margin,
                                 random.between(0.0, range.y()) - margin, 0.0);
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
      const Corners t = mesh.corners(f);
      const std::optional<Hit> at = hit(t, origin, inside);
      if (!at) continue;
      const Eigen::Vector3d b =
          testing::refract_by_angles(inside, area_normal(t).normalized(), setup.ior);
      const Eigen::Vector3d lands = at->place + (setup.focal_length - at->place.z()) / b.z() * b;
      const Eigen::Vector2d u = plane.to_pixels(lands.head<2>());
      if (u.minCoeff() < 0.0 || u.x() >= plane.columns() || u.y() >= plane.rows()) break;
      flux[static_cast<std::size_t>(static_cast<int>(u.y()) * plane.columns() +
                                    static_cast<int>(u.x()))] +=
          range.prod() / setup.lens_size.prod() / rays;
      break;
    }
  }
  return flux;
}

TEST(ObliqueRays, FacetPictureIsThatOfSingleRays) {
  const OpticalSetup setup = lit_from_the_side(testing::setup_of({24.0, 20.0}, {12, 10}, 60.0));
  const SurfaceMesh mesh = testing::height_field({24.0, 20.0}, {13, 13}, [](double x, double y) {
    return 5.0 + 0.3 * std::sin(0.4 * x) * std::cos(0.3 * y);
  });
  const int rays = 200000;
  const std::vector<double> traced = traced_flux(mesh, setup, rays);
  const RenderResult rendered =
      render_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial());
  double chi_square = 0.0;
  for (std::size_t i = 0; i < traced.size(); ++i) {
    const double expected =
        static_cast<double>(rendered.image.values()[i]) / static_cast<double>(traced.size());
    // Of a ray that is counted as range ÷ lens area, 672 ÷ 480 mm².
    const double variance = expected * 1.4 / rays;
    chi_square += (traced[i] - expected) * (traced[i] - expected) / std::max(variance, 1e-12);
  }
  // 120 pixels: mean 120, five standard deviations of 15.5 above it.
  EXPECT_LT(chi_square, 200.0);
  EXPECT_GT(chi_square, 60.0);
}

}  // namespace
}  // namespace lensforge
