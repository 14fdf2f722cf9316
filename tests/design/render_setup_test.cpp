// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"
#include "design/render_fields.h"

namespace lensforge {
namespace {

using testing::grid_mesh;
using ::testing::HasSubstr;
using testing::message_of;

/// 15 x 10 mm, moved off the origin.
SurfaceMesh shifted_mesh() {
  SurfaceMesh mesh = grid_mesh(7, 5, 2.5, 5.0);
  mesh.vertices.topRows<2>().colwise() += Eigen::Vector2d(-3.0, 4.0);
  return mesh;
}

TEST(RenderSetup, OfAMeshHasAnImageStraightAboveOfTheSameSize) {
  const OpticalSetup setup = setup_for_mesh(shifted_mesh());
  EXPECT_EQ(setup.lens_size, Eigen::Vector2d(15.0, 10.0));
  EXPECT_EQ(setup.image_size, setup.lens_size);
  EXPECT_EQ(setup.image_origin, Eigen::Vector2d(-3.0, 4.0));
  EXPECT_EQ(setup.pixels, Eigen::Vector2i(256, 171));
  EXPECT_EQ(setup.ior, OpticalSetup{}.ior);
}

TEST(RenderSetup, PixelsKeepTheImagesProportions) {
  OpticalSetup setup;
  setup.image_size = {20.0, 50.0};
  EXPECT_EQ(with_longer_side(setup, 100).pixels, Eigen::Vector2i(40, 100));
  setup.image_size = {1000.0, 1.0};
  EXPECT_EQ(with_longer_side(setup, 10).pixels, Eigen::Vector2i(10, 1));
}

TEST(RenderSetup, AWidthKeepsTheImagesProportionsAndCentre) {
  OpticalSetup setup;
  setup.image_size = {20.0, 50.0};
  setup.image_origin = {-4.0, 10.0};
  const OpticalSetup wide = with_image_width(setup, 80.0);
  EXPECT_EQ(wide.image_size, Eigen::Vector2d(80.0, 200.0));
  EXPECT_EQ(wide.image_origin + 0.5 * wide.image_size, setup.image_origin + 0.5 * setup.image_size);
  EXPECT_EQ(wide.pixels, setup.pixels);
}

TEST(RenderSetup, OptionsInTheTablesOrderSetTheWidthAndThenThePixels) {
  RenderOptions options{SurfaceModel::kFacet, setup_for_mesh(shifted_mesh())};
  const Description fields = description_of(options);
  for (const Field& field : fields) {
    if (field.name == "--image-width") field.set(30.0);
    if (field.name == "--pixels") field.set(60);
  }
  EXPECT_EQ(options.setup.image_size, Eigen::Vector2d(30.0, 20.0));
  EXPECT_EQ(options.setup.image_origin, Eigen::Vector2d(-10.5, -1.0));
  EXPECT_EQ(options.setup.pixels, Eigen::Vector2i(60, 40));
  EXPECT_EQ(fields.at("--image-width").get(), FieldValue(30.0));
  EXPECT_EQ(fields.at("--pixels").get(), FieldValue(60));
}

TEST(RenderSetup, TheWallLiesAboveTheSurface) {
  OpticalSetup setup = setup_for_mesh(shifted_mesh());
  setup.focal_length = shifted_mesh().vertices.row(2).maxCoeff();
  EXPECT_THAT(message_of<InputError>([&] { require_wall_above(shifted_mesh(), setup); }),
              HasSubstr("must stand above the whole surface"));
  setup.focal_length += 0.1;
  require_wall_above(shifted_mesh(), setup);
}

}  // namespace
}  // namespace lensforge
