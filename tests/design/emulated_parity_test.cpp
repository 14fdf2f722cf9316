// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/optics/height_fronts.h"
#include "design/emulated_executor.h"
#include "design/executor_parity.h"
#include "design/render/render_flux.h"
#include "design/stage_on_rough_mesh.h"
#include "design/transport_parity.h"

namespace lensforge::testing {
namespace {

struct EmulatedSide {
  using Exec = EmulatedExecutor;
  static Exec make(const Executor& options) { return Exec(options); }
  static std::unique_ptr<GuidedStage> stage(SurfaceModel model, Goal goal,
                                            const Executor& options) {
    return stage_on(model, goal, Exec(options));
  }
  static std::vector<double> render(SurfaceModel model) {
    return render_flux(rough_mesh(), kSetup, model, Exec(Executor::serial()));
  }
  static std::string missing() { return ""; }
};

INSTANTIATE_TYPED_TEST_SUITE_P(EmulatedGpu, ExecutorParity, EmulatedSide);
INSTANTIATE_TYPED_TEST_SUITE_P(EmulatedGpu, TransportParity, EmulatedSide);

/// The front's coefficients, which a light path refers to, are in the executor's memory, too.
TEST(EmulatedGpu, AFrontThatIsAHeightMapIsReadInItsOwnMemory) {
  OpticalSetup setup = kSetup;
  setup.front = height_front(kSize, {25, 21}, [](const Eigen::Vector2d& at) {
    return -0.2 + 0.2 * std::sin(0.3 * at.x()) * std::cos(0.25 * at.y());
  });
  const Eigen::Matrix3Xd vertices = rough_mesh().vertices;
  for (const SurfaceModel model : kModels) {
    const auto cpu = stage_on(model, Goal::kPicture, Executor::serial(), setup);
    const auto there = stage_on(model, Goal::kPicture, EmulatedExecutor(Executor::serial()), setup);
    Eigen::Matrix3Xd expected;
    Eigen::Matrix3Xd found;
    const double value = cpu->evaluate(vertices, expected).energy.total;
    EXPECT_NEAR(there->evaluate(vertices, found).energy.total, value, 1e-9 * value);
    EXPECT_LE(relative_difference(found, expected), 1e-9);
    EXPECT_LE(relative_difference(
                  render_flux(rough_mesh(), setup, model, EmulatedExecutor(Executor::serial())),
                  render_flux(rough_mesh(), setup, model, Executor::serial())),
              1e-9);
  }
}

/// Triangles that are made while they are deposited, against triangles in memory.
TEST(RenderFlux, IsTheSameAsOfProjectedTriangles) {
  for (const SurfaceModel model : kModels) {
    FluxImage image(kSetup.pixels.x(), kSetup.pixels.y());
    const auto direct = image.render(
        Executor::serial(), project_surface(rough_mesh(), kSetup, model, Executor::serial()));
    EXPECT_EQ(cpu_render(model), std::vector<double>(direct.begin(), direct.end()));
  }
}

struct ReadFirst {
  const double* values;
  double* out;
  void operator()(std::int64_t /*i*/) const { *out = *values; }
};

TEST(EmulatedGpuDeathTest, ItsMemoryIsNotTheCallers) {
  EmulatedBuffer<double> buffer(3);
  EXPECT_DEATH(static_cast<void>(*static_cast<volatile double*>(buffer.data())), "");
}

TEST(EmulatedGpu, FreshMemoryIsNotANumber) {
  const EmulatedExecutor executor(Executor::serial());
  const EmulatedBuffer<double> buffer(3);
  for (const double value : fetched(executor, std::span(buffer.data(), buffer.size()))) {
    EXPECT_TRUE(std::isnan(value));
  }
}

TEST(EmulatedGpu, NoticesAKernelThatIsGivenTheCallersMemory) {
  if (!EmulatedExecutor::kFindsAddresses) GTEST_SKIP() << "not in this kind of build";
  const EmulatedExecutor executor(Executor::serial());
  std::vector<double> mine{1.0};
  EmulatedBuffer<double> there(1);
  EXPECT_NONFATAL_FAILURE(parallel_for(executor, "wrong", 1, ReadFirst{mine.data(), there.data()}),
                          "points to the caller's memory");
}

TEST(EmulatedGpu, TooLittleMemoryEndsAMeasurementAndHarmsNoLaterOne) {
  const CellScene& scene = logo_scene();
  const auto stage = stage_of(scene, EmulatedExecutor(Executor::serial()));
  for (const std::size_t more : {std::size_t{1000}, 50 * scene.edges.edges.size()}) {
    EmulatedMemory::instance().limit_to(more);
    EXPECT_THROW(stage->measure(scene.edges), RunError);
    EmulatedMemory::instance().lift_limit();
  }
  const std::vector<double> expected = cpu_stage_of(scene)->measure(scene.edges).mass;
  EXPECT_LE(largest_difference(stage->measure(scene.edges).mass, expected, 1.0), 1e-9);
}

}  // namespace
}  // namespace lensforge::testing
