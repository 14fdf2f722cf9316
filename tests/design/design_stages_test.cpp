// SPDX-License-Identifier: GPL-3.0-or-later
// A whole design with every stage of it: transport, height fit, the update of Eq. 20 and
// rendering-guided optimisation.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/lens/surface_check.h"
#include "core/temp_folder.h"
#include "design/design.h"
#include "design/render.h"
#include "design/test_setups.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

using Status = DesignResult::Status;

/// Asks for a stop as soon as it sees that a kernel has run a number of times.
class StopAtKernel {
 public:
  StopAtKernel(const std::string& kernel, std::int64_t calls)
      : watch_([this, kernel, calls](const std::stop_token& end) {
          while (!end.stop_requested() && profile_.entries()[kernel].calls < calls) {
            std::this_thread::sleep_for(std::chrono::microseconds(50));
          }
          stop_.request_stop();
        }) {}

  [[nodiscard]] Executor executor() { return Executor::serial().with_profile(&profile_); }
  [[nodiscard]] RunControl control() const { return {stop_.get_token(), {}}; }

 private:
  KernelProfile profile_;
  std::stop_source stop_;
  std::jthread watch_;
};

/// A place in a design: after this share of a kernel's calls.
struct Place {
  const char* kernel;
  double share;
};

/// Kernels that tell a stage: the first call of "laplacian term" is one of the update.
constexpr Place kPlaces[] = {{"power cells", 0.1}, {"power cells", 0.9},    {"height fit", 0.2},
                             {"height fit", 0.8},  {"laplacian term", 0.0}, {"image term", 0.2},
                             {"image term", 0.8}};

class DesignStages : public ::testing::TestWithParam<SurfaceModel> {
 protected:
  DesignStages() {
    options_.model = GetParam();
    options_.pixels = 32;  // Vertices and faces are still more than one task's share.
    options_.rounds = 2;
    options_.transport_rounds = 2;
    options_.update_iterations = 2;
    options_.iterations = 2;
  }

  [[nodiscard]] DesignResult design(const Executor& executor,
                                    const RunControl& control = RunControl()) const {
    return design_lens(picture_, options_, executor, control);
  }

  /// Resumes a design that was stopped when a kernel had run a number of times.
  /// @return whether the stop came before the end.
  bool expect_resumed_equals(const DesignResult& whole, const std::string& kernel,
                             std::int64_t calls) {
    SCOPED_TRACE(kernel + ", call " + std::to_string(calls));
    const testing::TempFolder folder;
    options_.checkpoint = folder / "checkpoint";
    options_.resume = false;
    StopAtKernel stop(kernel, calls);
    const DesignResult part = design(stop.executor(), stop.control());
    options_.resume = true;
    expect_equal(design(Executor::serial()), whole);
    return part.status == Status::kInterrupted;
  }

  static void expect_equal(const DesignResult& result, const DesignResult& whole) {
    EXPECT_EQ(result.status, Status::kDone);
    EXPECT_EQ(result.lens.surface.vertices, whole.lens.surface.vertices);
    EXPECT_EQ(result.lens.render, whole.lens.render);
    EXPECT_EQ(timeless_csv(result), timeless_csv(whole));
  }

  /// Rows but for the time they took.
  static std::string timeless_csv(const DesignResult& result) {
    std::vector<ConvergenceRow> rows = result.convergence;
    for (ConvergenceRow& row : rows) row.seconds = 0.0;
    return convergence_csv(rows);
  }

  DesignOptions options_;
  /// One with much black, whose mesh takes the even mesh's transport, and one without.
  Image picture_ = GetParam() == SurfaceModel::kFacet ? testing::logo_picture(56)
                                                      : testing::spot_picture(56, 40);
};

INSTANTIATE_TEST_SUITE_P(Models, DesignStages, ::testing::ValuesIn(kMeshModels),
                         testing::model_name);

/// Its last level is another one than that of the mesh: control points instead of vertices.
class SplineStage : public DesignStages {};

INSTANTIATE_TEST_SUITE_P(Models, SplineStage, ::testing::Values(SurfaceModel::kSpline),
                         testing::model_name);

TEST_P(SplineStage, StoppedInTheSplineAndResumedGivesTheSameBits) {
  KernelProfile profile;
  options_.pixels = 20;
  options_.iterations = 10;
  const DesignResult whole = design(Executor::serial().with_profile(&profile));
  ASSERT_EQ(whole.status, Status::kDone);
  EXPECT_EQ(whole.lens.model, SurfaceModel::kSpline);
  ASSERT_TRUE(whole.lens.spline.has_value());
  EXPECT_EQ(whole.convergence.back().stage, "spline");
  const std::int64_t calls = profile.entries()["spline nodes"].calls;
  ASSERT_GT(calls, 10);
  expect_resumed_equals(whole, "spline nodes", calls / 2);
}

/// Before the spline's level a design is a smooth mesh, and its lens says so.
/// Its last level follows waves.
TEST_P(SplineStage, StoppedInTheWavesAndResumedGivesTheSameBits) {
  options_.light.model = LightModel::kWaves;
  options_.width = 2.7;
  options_.focal_length = 75.0;
  options_.pixels = 14;
  options_.iterations = 100;
  const DesignResult whole = design(Executor::cpu(2));
  EXPECT_EQ(whole.convergence.back().stage, "waves");
  EXPECT_GT(whole.convergence.back().round, 0);
  ASSERT_TRUE(whole.wall);
  EXPECT_TRUE(expect_resumed_equals(whole, "waves adjoint", 32));
  EXPECT_TRUE(expect_resumed_equals(whole, "waves adjoint", 3));
}

TEST_P(SplineStage, StoppedBeforeTheSplineIsASmoothLens) {
  StopAtKernel stop("image term", 1);
  options_.iterations = 100;
  const DesignResult part = design(stop.executor(), stop.control());
  ASSERT_EQ(part.status, Status::kInterrupted);
  EXPECT_EQ(part.lens.model, SurfaceModel::kSmooth);
  EXPECT_FALSE(part.lens.spline.has_value());
  EXPECT_EQ(part.lens.metrics.count(SurfaceModel::kSpline), 0U);
}

TEST_P(SplineStage, GivesTheSameBitsOnTwoThreads) {
  options_.pixels = 20;
  expect_equal(design(Executor::cpu(2)), design(Executor::serial()));
}

TEST_P(SplineStage, MeshAndPictureAreThoseOfTheSpline) {
  const DesignResult result = design(Executor::serial());
  ASSERT_EQ(result.status, Status::kDone);
  const Lens& lens = result.lens;
  EXPECT_FALSE(spline_fault(*lens.spline, lens.setup));
  const SampledSurface mesh = spline_nodes(*lens.spline, kMeshSamples);
  EXPECT_EQ(lens.surface.vertices, mesh.mesh.vertices);
  const SampledSurface nodes = picture_nodes(*lens.spline);
  Image render;
  const ImageMetrics found =
      evaluate(nodes.mesh, nodes.normals, lens.setup, lens.target, &render, Executor::serial());
  EXPECT_EQ(lens.metrics.at(SurfaceModel::kSpline).mae, found.mae);
  EXPECT_EQ(lens.render, render);
}

TEST_P(DesignStages, ThreadCountDoesNotChangeABit) {
  const DesignResult serial = design(Executor::serial());
  ASSERT_EQ(serial.status, Status::kDone);
  for (const int threads : {1, 2}) expect_equal(design(Executor::cpu(threads)), serial);
}

TEST_P(DesignStages, StoppedAnywhereAndResumedGiveTheSameBits) {
  options_.pixels = 20;
  KernelProfile profile;
  const DesignResult whole = design(Executor::serial().with_profile(&profile));
  ASSERT_EQ(whole.status, Status::kDone);
  int interrupted = 0;
  for (const Place& place : kPlaces) {
    const auto calls = static_cast<double>(profile.entries()[place.kernel].calls);
    ASSERT_GT(calls, 0.0) << place.kernel;
    const auto call = static_cast<std::int64_t>(std::ceil(place.share * calls));
    if (expect_resumed_equals(whole, place.kernel, std::max<std::int64_t>(1, call))) ++interrupted;
  }
  // The last ones may find a slow machine's watch too late.
  EXPECT_GE(interrupted, 2);
}

}  // namespace
}  // namespace lensforge
