// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/lens/lens.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/height_fronts.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

TEST(LensFront, AFolderHoldsTheHeightsOfItsFrontAndOfNoEarlierOne) {
  const testing::TempFolder folder;
  Lens lens;
  lens.setup.lens_size = {15.0, 10.0};
  lens.setup.pixels = {24, 16};
  lens.surface = make_grid_mesh(lens.setup.lens_size, {7, 5}, 5.0);
  lens.target = Image(24, 16, 0.5F);
  lens.setup.front = testing::height_front(
      lens.setup.lens_size, {9, 7}, [](const Eigen::Vector2d& at) { return -0.01 * at.x(); });
  write_lens(lens, folder.path());
  EXPECT_EQ(read_lens(folder.path()).setup, lens.setup);
  EXPECT_TRUE(fs::exists(folder / "front.exr"));
  lens.setup.front.reset();
  write_lens(lens, folder.path());
  EXPECT_EQ(read_lens(folder.path()).setup, lens.setup);
  EXPECT_FALSE(fs::exists(folder / "front.exr"));
}

}  // namespace
}  // namespace lensforge
