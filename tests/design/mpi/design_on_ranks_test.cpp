// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <string>

#include "design/design.h"
#include "design/mpi/rank_test.h"
#include "design/transport_scenes.h"

namespace lensforge {
namespace {

/// The surface of a small design, from which everything else follows.
SurfaceMesh designed(SurfaceModel model, const Executor& executor) {
  const Image picture = testing::spot_picture(64, 56);
  DesignOptions options = default_design_options(model, picture);
  options.rounds = 3;
  options.transport_rounds = 2;
  options.iterations = 30;
  const DesignResult result = design_lens(picture, options, executor, {});
  EXPECT_EQ(result.status, DesignResult::Status::kDone) << result.message;
  return result.lens.surface;
}

TEST(DesignOnRanks, IsThatOfOneProcess) {
  if (Ranks::world().count() == 1) GTEST_SKIP() << "that is one process";
  testing::on_first_rank([] {
    for (const SurfaceModel model : testing::kModels) {
      const SurfaceMesh whole = designed(model, Executor::serial());
      const SurfaceMesh shared = designed(model, Executor::serial().with_device(Device::kRanks));
      EXPECT_TRUE(shared.vertices == whole.vertices) << model_name(model);
    }
  });
}

}  // namespace
}  // namespace lensforge
