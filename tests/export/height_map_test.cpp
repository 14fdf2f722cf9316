// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/export.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

double slanted(double x, double y) { return 5.0 + 0.1 * x + 0.02 * y; }

Image slanted_map(int longer_side) {
  const SmoothSurface surface(surface_of({20.0, 10.0}, {21, 12}, slanted));
  return height_map(surface, longer_side, Executor::serial());
}

TEST(HeightMap, TakesHeightsAtPixelMiddlesWithTheFarSideOnTop) {
  const Image map = slanted_map(40);
  ASSERT_EQ(map.columns(), 40);
  ASSERT_EQ(map.rows(), 20);
  EXPECT_NEAR(map.at(0, 0), slanted(0.25, 9.75), 1e-6);
  EXPECT_NEAR(map.at(39, 0), slanted(19.75, 9.75), 1e-6);
  EXPECT_NEAR(map.at(7, 19), slanted(3.75, 0.25), 1e-6);
}

TEST(HeightMap, ExrKeepsMillimetres) {
  const TempFolder folder;
  const Image map = slanted_map(16);
  write_image(map, folder / "map.exr");
  EXPECT_EQ(read_image(folder / "map.exr").image, map);
}

TEST(HeightMap, GreyValuesAreLinearInHeight) {
  const TempFolder folder;
  const Image map = slanted_map(64);
  const GreyScale scale = write_grey_relief(map, folder / "map.png");
  const Image stored = read_image(folder / "map.png").image;
  for (int row = 0; row < map.rows(); ++row) {
    for (int column = 0; column < map.columns(); ++column) {
      const double grey = encode(stored.at(column, row));
      EXPECT_NEAR(scale.black + grey * (scale.white - scale.black), map.at(column, row), 5e-5);
    }
  }
}

TEST(HeightMap, StopRequestEndsTheMapAndItsFile) {
  const TempFolder folder;
  std::stop_source stop;
  const RunControl at_first_news(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  const SmoothSurface surface(surface_of({20.0, 10.0}, {21, 12}, slanted));
  EXPECT_THROW(height_map(surface, 2048, Executor::serial(), at_first_news), Interrupted);
  stop = std::stop_source();
  const RunControl again(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  EXPECT_THROW(write_image(slanted_map(256), folder / "map.exr", again), Interrupted);
  EXPECT_THROW(write_grey_relief(slanted_map(256), folder / "map.png", Executor::serial(), again),
               Interrupted);
  EXPECT_EQ(folder.file_count(), 0U);
}

/// Memory and disk are asked for what the arrays and files have.
TEST(ExportWork, GrowsWithPixelsAndControlPoints) {
  EXPECT_GT(height_map_work(1e8, true).memory_bytes, 8e8);
  EXPECT_EQ(height_map_work(1e8, false).disk_bytes, 4e8);
  EXPECT_NEAR(spline_solid_work(5e5).seconds, 51.0, 10.0);
  EXPECT_GT(spline_solid_work(4e6).memory_bytes, 4e9);
}

}  // namespace
}  // namespace lensforge::testing
