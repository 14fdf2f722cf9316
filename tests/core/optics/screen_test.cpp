// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/screen.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

OpticalSetup oblong_setup(ViewSide view) {
  OpticalSetup setup;
  setup.image_size = {120.0, 60.0};
  setup.image_origin = {-10.0, 5.0};
  setup.pixels = {240, 30};
  setup.view = view;
  return setup;
}

TEST(ImagePlane, FrontViewRunsAgainstXAndY) {
  const OpticalSetup setup = oblong_setup(ViewSide::kFront);
  const ImagePlane plane(setup);
  // docs/interface.md: pixel (c, r) covers x from origin + size − (c+1)·px to … − c·px, y likewise.
  const Eigen::Vector2d first = plane.to_mm({0.0, 0.0});
  EXPECT_NEAR(first.x(), 110.0, 1e-12);
  EXPECT_NEAR(first.y(), 65.0, 1e-12);
  const Eigen::Vector2d some = plane.to_mm({3.0, 4.0});
  EXPECT_NEAR(some.x(), 110.0 - 3 * 0.5, 1e-12);
  EXPECT_NEAR(some.y(), 65.0 - 4 * 2.0, 1e-12);
}

TEST(ImagePlane, RearViewMirrorsColumnsOnly) {
  const ImagePlane front(oblong_setup(ViewSide::kFront));
  const ImagePlane rear(oblong_setup(ViewSide::kRear));
  const Eigen::Vector2d mm(17.0, 23.0);
  EXPECT_NEAR(rear.to_pixels(mm).x(), 240.0 - front.to_pixels(mm).x(), 1e-12);
  EXPECT_NEAR(rear.to_pixels(mm).y(), front.to_pixels(mm).y(), 1e-12);
}

TEST(ImagePlane, ToMmUndoesToPixels) {
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    const ImagePlane plane(oblong_setup(view));
    const Eigen::Vector2d mm(-3.7, 41.9);
    EXPECT_LT((plane.to_mm(plane.to_pixels(mm)) - mm).norm(), 1e-12);
  }
}

TEST(ImagePlane, ScaleIsTheDerivativeOfToPixels) {
  const ImagePlane plane(oblong_setup(ViewSide::kFront));
  const Eigen::Vector2d step = plane.to_pixels({1.0, 1.0}) - plane.to_pixels({0.0, 0.0});
  EXPECT_LT((step - plane.pixels_per_mm()).norm(), 1e-12);
}

TEST(ImagePlane, TheRectangleIsThePicture) {
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    const ImagePlane plane(oblong_setup(view));
    const Eigen::Vector2d low = plane.to_mm({0.0, 0.0}).cwiseMin(plane.to_mm({240.0, 30.0}));
    const Eigen::Vector2d high = plane.to_mm({0.0, 0.0}).cwiseMax(plane.to_mm({240.0, 30.0}));
    EXPECT_LT((low - Eigen::Vector2d(-10.0, 5.0)).norm(), 1e-12);
    EXPECT_LT((high - Eigen::Vector2d(110.0, 65.0)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace lensforge
