// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/compute/cuda/launch.cuh"
#include "core/compute/executor.h"
#include "design/design.h"
#include "design/executor_parity.h"
#include "design/render/render_flux.h"
#include "design/stage_on_rough_mesh.h"
#include "design/test_setups.h"
#include "design/transport_parity.h"

namespace lensforge::testing {
namespace {

struct CudaSide {
  using Exec = CudaExecutor;
  static Exec make(const Executor& options) { return Exec(options); }
  static std::unique_ptr<GuidedStage> stage(SurfaceModel model, Goal goal,
                                            const Executor& options) {
    return make_cuda_stage(rough_mesh(), kSetup, 1.0, goal_of(goal),
                           options_of(model, ObjectiveWeights{}), options);
  }
  static std::vector<double> render(SurfaceModel model) {
    return render_flux_cuda(rough_mesh(), kSetup, model, Executor::serial());
  }
  static std::string missing() {
    static const Gpu gpu = find_gpu();
    return gpu.usable ? "" : gpu.reason;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, ExecutorParity, CudaSide);
INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, TransportParity, CudaSide);

class Cuda : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = CudaSide::missing(); !missing.empty()) {
      GTEST_SKIP() << "no GPU: " << missing;
    }
  }
};

struct FillIndex {
  double* out;
  LF_HD void operator()(std::int64_t i) const { out[i] = static_cast<double>(i); }
};

struct OneAndIndex {
  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    return {1.0, static_cast<double>(i)};
  }
};

TEST_F(Cuda, KernelsReachEveryItemOnce) {
  const CudaExecutor executor(Executor::serial());
  for (const std::size_t count : {1U, 127U, 128U, 129U, 100003U}) {
    DeviceBuffer<double> buffer(count);
    parallel_for(executor, "fill", static_cast<std::int64_t>(count), FillIndex{buffer.data()});
    const auto values = fetched(executor, std::span<const double>(buffer.data(), count));
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(values[i], static_cast<double>(i));
  }
}

TEST_F(Cuda, SumsReachEveryItemOnce) {
  const CudaExecutor executor(Executor::serial());
  for (const std::int64_t count : {0, 1, 127, 128, 129, 16385, 100003}) {
    const auto sum = pending_sum<2>(executor, "sum", count, OneAndIndex{}).get();
    EXPECT_EQ(sum[0], static_cast<double>(count));
    EXPECT_EQ(sum[1], 0.5 * static_cast<double>(count) * static_cast<double>(count - 1));
  }
}

TEST_F(Cuda, SumsThatWaitTogetherDoNotMixUp) {
  const CudaExecutor executor(Executor::serial());
  std::vector<CudaExecutor::PendingSum<2>> sums;
  for (int i = 0; i < CudaExecutor::kMaxPendingSums; ++i) {
    sums.push_back(pending_sum<2>(executor, "sum", 1000 + i, OneAndIndex{}));
  }
  for (int i = 0; i < CudaExecutor::kMaxPendingSums; ++i) {
    EXPECT_EQ(sums[static_cast<std::size_t>(i)].get()[0], 1000.0 + i);
  }
}

TEST_F(Cuda, TooLittleMemoryIsToldWithTheSizeNeeded) {
  std::size_t free = 0;
  std::size_t total = 0;
  LF_CUDA(cudaMemGetInfo(&free, &total));
  try {
    const DeviceBuffer<double> buffer(total / 4);  // Twice what there is.
    FAIL() << "was given more than there is";
  } catch (const RunError& e) {
    EXPECT_NE(std::string(e.what()).find("more are needed"), std::string::npos) << e.what();
  }
  const DeviceBuffer<double> small(1000);  // The failure has left no error behind.
  LF_CUDA(cudaGetLastError());
}

TEST_F(Cuda, AWrongLaunchNamesItsKernel) {
  const CudaExecutor executor(Executor::serial());
  try {
    parallel_for(executor, "too many", std::int64_t{1} << 60, FillIndex{nullptr});
    FAIL() << "launched more threads than a grid has";
  } catch (const RunError& e) {
    EXPECT_NE(std::string(e.what()).find("too many"), std::string::npos) << e.what();
  }
}

/// The acceptance of the GPU path: a whole design.
TEST_F(Cuda, ADesignEndsWithTheCpusError) {
  const Image picture = spot_picture(128, 128);
  DesignOptions options;
  options.pixels = 128;
  options.rounds = 2;
  options.iterations = 30;
  for (const SurfaceModel model : kModels) {
    options.model = model;
    const auto error = [&](const Executor& executor) {
      const DesignResult result = design_lens(picture, options, executor, {});
      EXPECT_EQ(result.status, DesignResult::Status::kDone) << result.message;
      return result.lens.metrics.at(model).mae;
    };
    const double expected = error(Executor::cpu());
    EXPECT_NEAR(error(Executor::cpu().with_device(Device::kCuda)), expected, 1e-3);
    EXPECT_LT(expected, 0.05);
  }
}

}  // namespace
}  // namespace lensforge::testing
