// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <utility>

#include "core/error.h"
#include "core/mesh/mesh_files.h"
#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/optics/outline.h"
#include "core/temp_folder.h"
#include "design/render.h"
#include "export/export.h"
#include "export/sample_surfaces.h"
#include "export/solid/solid_reading.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;

class ExportLens : public ::testing::Test {
 protected:
  ExportLens() {
    source_.lens.surface = testing::smooth_lens();
    source_.lens.setup.lens_size = source_.lens.setup.image_size = {30.0, 24.0};
    source_.lens.setup.pixels = {15, 12};
    source_.lens.target = Image(15, 12, 1.0F);
    source_.file = folder_ / "surface.ply";
    write_ply(source_.lens.surface, source_.file);
  }

  [[nodiscard]] ExportResult write(const char* name, const ExportOptions& options = {}) {
    const ExportHooks hooks{[this](const WorkEstimate& /*work*/) { ++announced_; },
                            [this] { ++begun_; }};
    return export_lens(source_, folder_ / name, options, Executor::cpu(1), {}, hooks);
  }

  TempFolder folder_;
  ExportSource source_;
  int announced_ = 0;
  int begun_ = 0;
};

TEST_F(ExportLens, ACallWritesTheSolidAndSaysHowGoodItIs) {
  ExportOptions options;
  options.tolerance = options.normal_tolerance = 0.01;
  const ExportResult result = write("lens.step", options);
  EXPECT_EQ(result.format, "step");
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_TRUE(result.within_tolerance());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  EXPECT_NEAR(result.splines->content.volume, result.splines->mesh_volume,
              1e-4 * result.splines->mesh_volume);
  EXPECT_NEAR(result.splines->picture.mae, result.metrics.at(SurfaceModel::kSmooth).mae, 1e-3);
  EXPECT_EQ(announced_, 1);
  EXPECT_EQ(begun_, 1);
  const std::string file = testing::read_bytes(folder_ / "lens.step");
  EXPECT_NE(file.find("sha256:"), std::string::npos);
}

/// The file's own surface, read as any other solid, reflects the picture that the mirror does.
TEST_F(ExportLens, AMirrorsMeshBecomesASolidThatReflectsItsPicture) {
  OpticalSetup& setup = source_.lens.setup;
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  setup.focal_length = 30.0;
  setup.image_size = {44.0, 36.0};  // All of its light.
  setup.image_origin = {15.0 - 22.0 + 25.0 * std::tan(std::asin(0.5)), 12.0 - 18.0};
  Lens& mirror = source_.lens;
  evaluate(mirror.surface, setup, SurfaceModel::kSmooth, mirror.target, &mirror.target,
           Executor::cpu(1));
  ExportOptions options;
  options.tolerance = options.normal_tolerance = 0.001;
  const ExportResult result = write("mirror.step", options);
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  EXPECT_LT(result.splines->picture.mae, 3e-3);
  const SolidSurface solid = read_solid_surface(folder_ / "mirror.step", 40000.0, Executor::cpu(1));
  EXPECT_TRUE(solid.by_name);
  const ImageMetrics read = evaluate(solid.samples.mesh, solid.samples.normals, setup,
                                     mirror.target, nullptr, Executor::cpu(1));
  EXPECT_NEAR(read.mae, result.splines->picture.mae, 2e-4);
}

TEST_F(ExportLens, MeshesAndHeightMapsComeByTheNameOfTheFile) {
  const ExportResult mesh = write("lens.stl");
  ASSERT_TRUE(mesh.mesh.has_value());
  EXPECT_GT(mesh.mesh->triangles, source_.lens.surface.triangle_count());
  ExportOptions options;
  options.pixels = 40;
  const ExportResult heights = write("lens.png", options);
  ASSERT_TRUE(heights.heights.has_value());
  EXPECT_EQ(heights.heights->pixels.columns, 40);
  EXPECT_NEAR(heights.heights->pixel, 0.75, 1e-12);
  EXPECT_TRUE(heights.heights->scale.has_value());
}

/// Light through a curved front, and the splines that are fitted to its picture.
TEST_F(ExportLens, ALensWithASphericalFrontKeepsItsPictureAndItsVolume) {
  source_.lens.setup.front = spherical_front(200.0, source_.lens.setup.lens_size);
  ExportOptions loose;
  loose.tolerance = loose.normal_tolerance = 0.01;
  for (const auto& [name, options] :
       {std::pair("lens.step", ExportOptions()), {"lens.igs", loose}}) {
    const ExportResult result = write(name, options);
    ASSERT_TRUE(result.splines.has_value());
    EXPECT_TRUE(result.splines->content.is_one_solid());
    EXPECT_NEAR(result.splines->content.volume, result.splines->mesh_volume,
                2e-4 * result.splines->mesh_volume);
    EXPECT_LT(result.splines->content.low[2], -0.5);
    EXPECT_NEAR(result.splines->picture.mae, result.metrics.at(SurfaceModel::kSmooth).mae, 1e-3);
  }
}

/// What no mesh knew: the file's own face, trimmed, makes the picture that the lens does.
TEST_F(ExportLens, ALensWithAnOutlineKeepsItsPictureAndItsVolume) {
  OpticalSetup& setup = source_.lens.setup;
  const Eigen::Vector2d size = setup.lens_size;
  setup.image_size = 2.0 * size;  // All of its light.
  setup.image_origin = -0.5 * size;
  for (const Outline& outline :
       {circle_outline(size),
        polygon_outline(size, {{0, 0}, {5, 0}, {5, 1}, {1, 1}, {1, 4}, {0, 4}})}) {
    setup.outline = outline;
    Lens& lens = source_.lens;
    evaluate(lens.surface, setup, SurfaceModel::kSmooth, lens.target, &lens.target,
             Executor::cpu(1));
    ExportOptions options;
    options.max_points = 3000;
    for (const char* name : {"lens.step", "lens.igs"}) {
      const ExportResult result = write(name, options);
      ASSERT_TRUE(result.splines.has_value());
      EXPECT_TRUE(result.splines->content.is_one_solid());
      EXPECT_EQ(result.splines->net.patches.size(), 1U);
      EXPECT_NEAR(result.splines->content.volume, result.splines->mesh_volume,
                  2e-4 * result.splines->mesh_volume);
      EXPECT_LT(result.splines->picture.mae, 1e-3);
    }
    const SolidSurface solid = read_solid_surface(folder_ / "lens.step", 2e5, Executor::cpu(1));
    EXPECT_TRUE(solid.by_name);
    EXPECT_EQ(solid.faces, 1);
    const ImageMetrics read = evaluate(solid.samples.mesh, solid.samples.normals, setup,
                                       lens.target, nullptr, Executor::cpu(1));
    // Its raster leaves the cells on the rim out.
    EXPECT_LT(read.mae, 1e-2);
    EXPECT_TRUE(write("lens.stl").mesh.has_value());
    EXPECT_TRUE(write("lens.glb").mesh.has_value());
  }
}

TEST_F(ExportLens, ALensWithAHeightMapForAFrontKeepsItsPictureAndItsVolume) {
  source_.lens.setup.front = lensforge::testing::height_front(
      source_.lens.setup.lens_size, {41, 33},
      [](const Eigen::Vector2d& at) { return -0.3 + 0.3 * std::sin(0.25 * at.x()); });
  const ExportResult result = write("lens.step");
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  EXPECT_NEAR(result.splines->content.volume, result.splines->mesh_volume,
              2e-4 * result.splines->mesh_volume);
  EXPECT_NEAR(result.splines->picture.mae, result.metrics.at(SurfaceModel::kSmooth).mae, 1e-3);
}

TEST_F(ExportLens, ASurfaceThatReachesDownToItsFrontIsRefused) {
  source_.lens.setup.front = spherical_front(200.0, source_.lens.setup.lens_size);
  std::get<SphericalFront>(*source_.lens.setup.front).apex.z() = 5.0;
  EXPECT_THAT(message_of<InputError>([&] { (void)write("lens.step"); }),
              HasSubstr("reaches down to its front"));
  EXPECT_EQ(folder_.file_count(), 1U);
}

TEST_F(ExportLens, WhatIsWrongIsToldBeforeAnythingIsWritten) {
  ExportOptions options;
  for (const char* author : {"two\nlines", "M\xc3\xbcller", "\x7f"}) {
    options.author = author;
    EXPECT_THAT(message_of<InputError>([&] { (void)write("a.step", options); }),
                HasSubstr("--author: holds a character that is not printable ASCII"));
  }
  options = {};
  options.tolerance = 2.0;
  EXPECT_THAT(message_of<InputError>([&] { (void)write("a.step", options); }),
              HasSubstr("--tolerance 2: must be 1e-06 to 1 mm"));
  EXPECT_THAT(message_of<InputError>([&] { (void)write("a.doc"); }), HasSubstr("must end in"));
  EXPECT_EQ(folder_.file_count(), 1U);
  EXPECT_EQ(begun_, 0);
}

}  // namespace
}  // namespace lensforge
