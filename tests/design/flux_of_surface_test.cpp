// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

namespace lensforge {
namespace {

using testing::kSetup;
using testing::kSize;
using testing::Random;

struct Light {
  std::string name;
  std::function<void(OpticalSetup&)> change;
};

void mirror(OpticalSetup& setup) {
  setup.mode = LightMode::kReflect;
  setup.light = Eigen::Vector3d(0.2, 0.1, -1.0).normalized();
}

const std::vector<Light>& lights() {
  static const std::vector<Light> all{
      {"Parallel", [](OpticalSetup&) {}},
      {"Point",
       [](OpticalSetup& s) {
         s.point = PointSource{{10.0, 12.0, -90.0}, Emission::kLambertian};
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
}  // namespace lensforge
