// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "design/cpu_reference.h"
#include "design/emulated_executor.h"
#include "design/executor_parity.h"
#include "design/transport_parity.h"

namespace lensforge::testing {
namespace {

/// Names the tests that a build without CUDA leaves out.
struct AbsentSide {
  using Exec = EmulatedExecutor;
  static Exec make(const Executor& options) { return Exec(options); }
  static std::unique_ptr<GuidedStage> stage(SurfaceModel model, Goal goal, const Executor&) {
    return cpu_stage(model, goal);
  }
  static std::vector<double> render(SurfaceModel model) { return cpu_render(model); }
  static std::string missing() { return find_gpu().reason; }
};

INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, ExecutorParity, AbsentSide);
INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, TransportParity, AbsentSide);

}  // namespace
}  // namespace lensforge::testing
