// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render/render_flux.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/random_input.h"
#include "design/render.h"
#include "design/snell.h"
#include "design/test_setups.h"

namespace lensforge::render_flux_test {
namespace {

using testing::height_field;
using testing::kSetup;
using testing::Random;
using testing::setup_of;

const Eigen::Vector2d kLens(20.0, 16.0);
const GridShape kShape{25, 23};
constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// Millimetres on the receiving plane of a corner of an image triangle.
Eigen::Vector2d landing_mm(const OpticalSetup& setup, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d per_pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>());
  return setup.image_origin + setup.image_size - pixel.cwiseProduct(per_pixel);
}

/// Calls check(vertex, landing point in mm) for every corner of every image triangle.
template <class Check>
void for_each_landing(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Check& check) {
  const auto triangles = project_surface(mesh, setup, model, Executor::cpu(2));
  ASSERT_EQ(static_cast<std::int64_t>(triangles.size()), mesh.triangle_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const ImageTriangle& image = triangles[static_cast<std::size_t>(t)];
    check(mesh.triangles(0, t), landing_mm(setup, image.p0));
    check(mesh.triangles(1, t), landing_mm(setup, image.p1));
    check(mesh.triangles(2, t), landing_mm(setup, image.p2));
  }
}

double total_flux(const std::vector<ImageTriangle>& triangles) {
  return std::accumulate(triangles.begin(), triangles.end(), 0.0,
                         [](double sum, const ImageTriangle& t) { return sum + t.flux; });
}

TEST(SurfaceOptics, APlaneSendsLightStraightOn) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  const SurfaceMesh mesh = make_grid_mesh(kLens, kShape, 5.0);
  for (const SurfaceModel model : kModels) {
    for_each_landing(mesh, setup, model, [&](int v, const Eigen::Vector2d& landing) {
      ASSERT_LT((landing - mesh.vertices.col(v).head<2>()).norm(), 1e-13);
    });
  }
}

TEST(SurfaceOptics, APrismShiftsByTheAngleOfDeflection) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  const double tilt = 0.2;
  const double direction = 0.7;
  const Eigen::Vector2d uphill(std::cos(direction), std::sin(direction));
  const SurfaceMesh mesh = height_field(kLens, kShape, [&](double x, double y) {
    return 6.0 + std::tan(tilt) * uphill.dot(Eigen::Vector2d(x, y));
  });
  const double slope = std::tan(testing::refracted_angle(tilt, setup.ior) - tilt);
  for (const SurfaceModel model : kModels) {
    for_each_landing(mesh, setup, model, [&](int v, const Eigen::Vector2d& landing) {
      const Eigen::Vector3d p = mesh.vertices.col(v);
      const Eigen::Vector2d expected = p.head<2>() + (150.0 - p.z()) * slope * uphill;
      ASSERT_LT((landing - expected).norm(), 1e-12);
    });
  }
}

TEST(SurfaceOptics, AParaboloidFollowsTheExactRayLawAtInnerVertices) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  const double radius = 60.0;
  const Eigen::Vector2d centre = 0.5 * kLens;
  const SurfaceMesh mesh = height_field(kLens, kShape, [&](double x, double y) {
    return 8.0 - (Eigen::Vector2d(x, y) - centre).squaredNorm() / (2.0 * radius);
  });
  // Rings of the grid are symmetric about their vertex away from the left and right border; there
  // the area-weighted normal of a paraboloid is exact.
  int checked = 0;
  const auto check = [&](int v, const Eigen::Vector2d& landing) {
    const int column = v % kShape.columns;
    const int row = v / kShape.columns;
    if (std::min(column, kShape.columns - 1 - column) <= kShiftFade) return;
    if (row == 0 || row == kShape.rows - 1) return;
    const Eigen::Vector3d p = mesh.vertices.col(v);
    const Eigen::Vector2d from_axis = p.head<2>() - centre;
    const double tilt = std::atan(from_axis.norm() / radius);
    const double deflection = testing::refracted_angle(tilt, setup.ior) - tilt;
    const Eigen::Vector2d inwards = -from_axis.stableNormalized();
    const Eigen::Vector2d expected = p.head<2>() + (150.0 - p.z()) * std::tan(deflection) * inwards;
    ASSERT_LT((landing - expected).norm(), 1e-11);
    ++checked;
  };
  for_each_landing(mesh, setup, SurfaceModel::kSmooth, check);
  EXPECT_GT(checked, 1000);
}

TEST(SurfaceOptics, TransmittedFluxAddsUpToOne) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  const SurfaceMesh mesh = height_field(kLens, kShape, testing::bumps);
  for (const SurfaceModel model : kModels) {
    EXPECT_NEAR(total_flux(project_surface(mesh, setup, model, Executor::serial())), 1.0, 1e-13);
  }
}

TEST(SurfaceOptics, SteepPlacesAreDark) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  SurfaceMesh mesh = make_grid_mesh(kLens, kShape, 5.0);
  const int spike = 11 * kShape.columns + 12;
  mesh.vertices(2, spike) += 3.0;
  const double dark = 6.0 / static_cast<double>(mesh.triangle_count());
  // The smooth model has an even normal on the spike itself and steep ones around it.
  EXPECT_NEAR(total_flux(project_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial())),
              1.0 - dark, 1e-12);
  EXPECT_LT(total_flux(project_surface(mesh, setup, SurfaceModel::kSmooth, Executor::serial())),
            1.0 - dark);
}

TEST(SurfaceOptics, ThreadCountDoesNotChangeABit) {
  const OpticalSetup setup = setup_of(kLens, {40, 32}, 150.0);
  const SurfaceMesh mesh = height_field(kLens, {90, 80}, testing::bumps);
  for (const SurfaceModel model : kModels) {
    const auto serial = project_surface(mesh, setup, model, Executor::serial());
    const auto parallel = project_surface(mesh, setup, model, Executor::cpu(2));
    for (std::size_t i = 0; i < serial.size(); ++i) {
      ASSERT_TRUE(serial[i].p0 == parallel[i].p0 && serial[i].p1 == parallel[i].p1 &&
                  serial[i].p2 == parallel[i].p2 && serial[i].flux == parallel[i].flux);
    }
  }
}

struct Light {
  std::string name;
  std::function<void(OpticalSetup&)> change;
};

void mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{Eigen::Vector3d(0.2, 0.1, -1.0).normalized()};
}

const std::vector<Light>& lights() {
  static const std::vector<Light> all{
      {"Parallel", [](OpticalSetup&) {}},
      {"Point",
       [](OpticalSetup& s) {
         s.lamp = PointSource{{10.0, 12.0, -90.0}, Emission::kLambertian};
       }},
      {"Mirror", mirror},
      {"Losses", [](OpticalSetup& s) { s.fresnel = true; }},
      {"Rear", [](OpticalSetup& s) { s.view = ViewSide::kRear; }}};
  return all;
}

class FluxOfSurfaceUnder : public ::testing::TestWithParam<std::tuple<SurfaceModel, Light>> {
 protected:
  static SurfaceModel model() { return std::get<0>(GetParam()); }
  static OpticalSetup setup() {
    OpticalSetup setup = kSetup;
    std::get<1>(GetParam()).change(setup);
    return setup;
  }
};
std::string name_of(const ::testing::TestParamInfo<std::tuple<SurfaceModel, Light>>& test) {
  return model_name(std::get<0>(test.param)) + "_" + std::get<1>(test.param).name;
}
INSTANTIATE_TEST_SUITE_P(Lights, FluxOfSurfaceUnder,
                         ::testing::Combine(::testing::ValuesIn(testing::kModels),
                                            ::testing::ValuesIn(lights())),
                         name_of);

std::vector<double> random_cotangent(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> cotangent(static_cast<std::size_t>(kSetup.pixels.prod()));
  for (double& g : cotangent) g = random.between(-1.0, 1.0);
  return cotangent;
}

/// Error of the adjoint against central differences along random directions, relative to the
/// product with the derivative's entries.
double slope_error(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model) {
  const std::vector<double> cotangent = random_cotangent(5);
  const Eigen::Matrix3Xd bar =
      flux_of_surface_adjoint(mesh, setup, model, cotangent, Executor::serial());
  const auto f = [&](const Eigen::VectorXd& x) {
    SurfaceMesh moved = mesh;
    moved.vertices = x.reshaped(3, mesh.vertex_count());
    const std::vector<double> flux = flux_of_surface(moved, setup, model, Executor::serial());
    return std::inner_product(flux.begin(), flux.end(), cotangent.begin(), 0.0);
  };
  Random random(6);
  Eigen::Matrix3Xd direction = bar;
  for (double& d : direction.reshaped()) d = random.between(-1.0, 1.0);
  // Corners of image triangles that cross borders of pixels call for small steps.
  return testing::slope_error(f, mesh.vertices.reshaped(), bar.reshaped(), direction.reshaped(),
                              {1e-5, 1e-6, 1e-7, 3e-8, 1e-8});
}

TEST_P(FluxOfSurfaceUnder, IsThePictureThatIsRendered) {
  const SurfaceMesh mesh = testing::rough_mesh();
  const std::vector<double> flux = flux_of_surface(mesh, setup(), model(), Executor::serial());
  const RenderResult result = render_surface(mesh, setup(), model(), Executor::serial());
  for (std::size_t i = 0; i < flux.size(); ++i) {
    ASSERT_FLOAT_EQ(static_cast<float>(flux[i] * setup().pixels.prod()), result.image.values()[i]);
  }
}

TEST_P(FluxOfSurfaceUnder, AdjointEqualsCentralDifferences) {
  EXPECT_LT(slope_error(testing::rough_mesh(), setup(), model()), 1e-6);
}

TEST_P(FluxOfSurfaceUnder, AdjointHasTheSameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = testing::rough_mesh();
  const auto adjoint = [&](const Executor& executor) {
    return flux_of_surface_adjoint(mesh, setup(), model(), random_cotangent(1), executor);
  };
  EXPECT_EQ(adjoint(Executor::serial()), adjoint(Executor::cpu(2)));
}

TEST(FluxOfSurface, AdjointUnderAnExtendedSourceEqualsCentralDifferences) {
  OpticalSetup setup = kSetup;
  setup.extent.width = 0.02;
  for (const SurfaceModel model : testing::kModels) {
    EXPECT_LT(slope_error(testing::rough_mesh(), setup, model), 1e-6);
  }
}

TEST(FluxOfSurface, FacesWhoseLightDoesNotLeaveHaveNoDerivative) {
  SurfaceMesh mesh = testing::rough_mesh();
  // A spike so steep that the light on its sides is reflected totally.
  const std::int64_t spike = testing::kShape.columns * 14 + 15;
  mesh.vertices(2, spike) += 40.0;
  for (const SurfaceModel model : testing::kModels) {
    const Eigen::Matrix3Xd bar =
        flux_of_surface_adjoint(mesh, kSetup, model, random_cotangent(2), Executor::serial());
    EXPECT_TRUE(bar.allFinite());
    if (model == SurfaceModel::kFacet) {
      EXPECT_EQ(bar(2, spike), 0.0);
    }
  }
}

TEST(FluxOfSurface, AdjointOfAnOutlinedLensIsRefused) {
  OpticalSetup setup = kSetup;
  setup.outline = Outline{};
  EXPECT_THROW(flux_of_surface_adjoint(testing::rough_mesh(), setup, SurfaceModel::kFacet,
                                       random_cotangent(3), Executor::serial()),
               InputError);
}

}  // namespace

}  // namespace lensforge::render_flux_test
