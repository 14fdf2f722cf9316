// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/ray_trace.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/lens_scene.h"
#include "design/render.h"

namespace lensforge::bench {
namespace {

constexpr std::int64_t kRays = 1 << 20;

/// A lens whose surface rises by `slope` along +x, before a grey picture.
Lens prism(double slope, ViewSide view) {
  Lens lens;
  lens.setup = paper_setup(16);
  lens.setup.view = view;
  lens.surface = make_grid_mesh(lens.setup.lens_size, {9, 11}, 5.0);
  lens.surface.vertices.row(2) += slope * lens.surface.vertices.row(0);
  lens.target = Image(16, 16, 0.5F);
  return lens;
}

/// Share of the light that stays in the picture: by Snell's law it is bent by arcsin(n sin a) − a
/// towards the thicker side, and the strip that passes x = 100 mm is lost.
double prism_share(double slope, const OpticalSetup& setup) {
  const double angle = std::atan(slope);
  const double turn = std::tan(std::asin(setup.ior * std::sin(angle)) - angle);
  return (100.0 - (setup.focal_length - 5.0) * turn) / (1.0 - slope * turn) / 100.0;
}

class RayTracePrism : public ::testing::TestWithParam<SurfaceModel> {};

TEST_P(RayTracePrism, BendsByTheAngleOfSnellsLaw) {
  const Lens lens = prism(0.1, ViewSide::kFront);
  const RayTraceResult result = trace_rays(lens, {GetParam(), kRays, 1}, Executor::serial());
  EXPECT_NEAR(result.metrics.flux_inside, prism_share(0.1, lens.setup), 1e-4);
  EXPECT_EQ(result.missed + result.trapped + result.met_again, 0);
  EXPECT_GT(result.render.at(0, 8), 0.4);
  EXPECT_EQ(result.render.at(15, 8), 0.0);
}

INSTANTIATE_TEST_SUITE_P(BothModels, RayTracePrism,
                         ::testing::Values(SurfaceModel::kFacet, SurfaceModel::kSmooth));

TEST(RayTrace, RearViewIsMirrored) {
  const Lens lens = prism(0.1, ViewSide::kRear);
  const RayTraceResult result =
      trace_rays(lens, {SurfaceModel::kFacet, kRays, 1}, Executor::serial());
  EXPECT_EQ(result.render.at(0, 8), 0.0);
  EXPECT_GT(result.render.at(15, 8), 0.4);
}

TEST(RayTrace, ASlopeBeyondTheCriticalAngleTrapsAllLight) {
  const Lens lens = prism(1.2, ViewSide::kFront);
  const RayTraceResult result =
      trace_rays(lens, {SurfaceModel::kFacet, kRays, 1}, Executor::serial());
  EXPECT_EQ(result.trapped, result.rays);
}

TEST(RayTrace, AgreesWithTheExactRenderingWithinItsNoise) {
  Lens lens = prism(0.0, ViewSide::kFront);
  lens.surface = lens_like_mesh({41, 47});
  lens.target = grey_scene(16);
  const ImageMetrics exact = evaluate(lens.surface, lens.setup, SurfaceModel::kFacet, lens.target,
                                      nullptr, Executor::serial());
  const RayTraceResult result =
      trace_rays(lens, {SurfaceModel::kFacet, kRays, 1}, Executor::serial());
  EXPECT_LT(result.noise, 1e-3);
  EXPECT_NEAR(result.metrics.mae, exact.mae, result.noise);
  EXPECT_NEAR(result.metrics.ssim, exact.ssim, 1e-3);
  EXPECT_NEAR(result.metrics.flux_inside, exact.flux_inside, 1e-4);
}

TEST(RayTrace, SamePictureForAnyNumberOfThreads) {
  const Lens lens = prism(0.05, ViewSide::kFront);
  const RayTraceOptions options{SurfaceModel::kFacet, kRays / 8, 1};
  EXPECT_EQ(trace_rays(lens, options, Executor::serial()).render,
            trace_rays(lens, options, Executor::cpu(2)).render);
}

}  // namespace
}  // namespace lensforge::bench
