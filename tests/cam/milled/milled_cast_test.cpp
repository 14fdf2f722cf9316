// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "cam/cam_meshes.h"
#include "cam/milled/mould.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_tiles.h"

namespace lensforge {
namespace {

TEST(CastField, WhatIsCastInALensesMouldIsTheLens) {
  const SurfaceMesh lens = testing::grid_mesh(21, 17, 3.0, 2.0, testing::lens_relief);
  const MouldOptions options{0.02, 4.0};
  const SurfaceMesh mould = mould_surface(lens, options);
  const FacetField lens_field(lens);
  const FacetField mould_field(mould);
  const CastField cast(mould_field, {1.0 / 0.98, 3.0, lens.vertices.row(2).maxCoeff(), 4.0});
  GridWindow window = testing::window_at({0.013, 0.017}, 0.0171, 90, 70);
  window.first_column = 20;
  window.first_row = 30;
  const SurfacePatch expected = testing::sampled(lens_field, window);
  const SurfacePatch found = testing::sampled(cast, window);
  for (std::size_t i = 0; i < expected.z.size(); ++i) {
    EXPECT_NEAR(found.z[i], expected.z[i], 1e-12);
    EXPECT_NEAR(found.slope_x[i], expected.slope_x[i], 1e-12);
    EXPECT_NEAR(found.slope_y[i], expected.slope_y[i], 1e-12);
  }
}

}  // namespace
}  // namespace lensforge
