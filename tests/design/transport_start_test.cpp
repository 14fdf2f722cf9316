// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/transport_start.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <string>

#include "design/grid_mesh.h"
#include "design/render_lens.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

constexpr GridShape kShape{61, 57};

double error_of(const SurfaceMesh& mesh, const OpticalSetup& setup, const Image& picture) {
  return evaluate(mesh, setup, SurfaceModel::kSmooth, picture, nullptr, Executor::serial()).mae;
}

TEST(TransportStart, ASmoothPictureIsNearlyThereAtOnce) {
  OpticalSetup setup = testing::setup_of({50.0, 40.0}, {40, 32}, 200.0);
  const Image picture = testing::spot_picture(40, 32);
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    setup.view = view;
    SurfaceMesh mesh = make_grid_mesh({50.0, 40.0}, kShape, 5.0);
    const double flat = error_of(mesh, setup, picture);
    ASSERT_TRUE(start_from_transport(picture, setup, RunControl(), mesh));
    const double started = error_of(mesh, setup, picture);
    RecordProperty("mae_flat", std::to_string(flat));
    RecordProperty("mae_started", std::to_string(started));
    EXPECT_LT(started, 0.1 * flat);
  }
}

TEST(TransportStart, KeepsXAndY) {
  const OpticalSetup setup = testing::setup_of({50.0, 40.0}, {40, 32}, 200.0);
  const SurfaceMesh flat = make_grid_mesh({50.0, 40.0}, kShape, 5.0);
  SurfaceMesh mesh = flat;
  ASSERT_TRUE(start_from_transport(testing::spot_picture(40, 32), setup, RunControl(), mesh));
  EXPECT_EQ(mesh.vertices.topRows<2>(), flat.vertices.topRows<2>());
  EXPECT_GT(mesh.vertices.row(2).maxCoeff() - mesh.vertices.row(2).minCoeff(), 0.1);
}

TEST(TransportStart, UniformLightNeedsNoShape) {
  const OpticalSetup setup = testing::setup_of({50.0, 40.0}, {40, 32}, 200.0);
  SurfaceMesh mesh = make_grid_mesh({50.0, 40.0}, kShape, 5.0);
  ASSERT_TRUE(start_from_transport(Image(40, 32, 0.5F), setup, RunControl(), mesh));
  EXPECT_LT((mesh.vertices.row(2).array() - 5.0).abs().maxCoeff(), 1e-10);
}

TEST(TransportStart, LeavesTheMeshAloneWhenAskedToStop) {
  const OpticalSetup setup = testing::setup_of({50.0, 40.0}, {40, 32}, 200.0);
  const SurfaceMesh flat = make_grid_mesh({50.0, 40.0}, kShape, 5.0);
  SurfaceMesh mesh = flat;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(start_from_transport(testing::spot_picture(40, 32), setup,
                                    RunControl(stop.get_token(), {}), mesh));
  EXPECT_EQ(mesh.vertices, flat.vertices);
}

}  // namespace
}  // namespace lensforge
