// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/optics/light_source.h"
#include "core/optics/refraction.h"
#include "core/optics/screen.h"
#include "core/spline/control_net.h"
#include "design/random_input.h"
#include "design/schedule/two_faces.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

TEST(TwoFaceStart, FitsTheSlopesOfAQuadratic) {
  const Eigen::Vector2d size(12.0, 9.0);
  const Eigen::Vector2i cells(12, 9);
  testing::Random random(4);
  Eigen::Matrix2Xd points(2, 600);
  Eigen::Matrix2Xd slopes(2, 600);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    points.col(k) << random.between(0.0, size.x()), random.between(0.0, size.y());
    slopes.col(k) << 0.02 * points(0, k) - 0.03 * points(1, k), 0.1 - 0.03 * points(0, k);
  }
  const Eigen::MatrixXd heights = fit_spline_slopes(points, slopes, size, cells);
  ASSERT_EQ(heights.rows(), cells.x() + kSplineDegree);
  EXPECT_NEAR(heights.mean(), 0.0, 1e-9);
  const double first = heights(0, 0);  // A spline begins at its first coefficient.
  const auto height = [](double x, double y) { return 0.01 * x * x - 0.03 * x * y + 0.1 * y; };
  const Eigen::Index i = heights.rows() - 1;
  const Eigen::Index j = heights.cols() - 1;
  EXPECT_NEAR(heights(i, 0) - first, height(size.x(), 0.0), 2e-3);
  EXPECT_NEAR(heights(0, j) - first, height(0.0, size.y()), 2e-3);
  EXPECT_NEAR(heights(i, j) - first, height(size.x(), size.y()), 2e-3);
}

/// A screen with a square picture in the middle of the axis of a lens of 20 mm.
OpticalSetup centred(double width, double z) {
  OpticalSetup setup = testing::setup_of({20.0, 20.0}, {16, 16}, z);
  setup.image_size = {width, width};
  setup.image_origin.setConstant(0.5 * (20.0 - width));
  return setup;
}

TEST(TwoFaceStart, FacesSendLightAlongItsRaysForEveryLamp) {
  const Lamp lamps[] = {ParallelLight{}, PointSource{{10.0, 10.0, -80.0}, Emission::kIsotropic}};
  for (const Lamp& lamp : lamps) {
    OpticalSetup first = centred(18.0, 60.0);
    OpticalSetup second = centred(24.0, 260.0);
    first.lamp = second.lamp = lamp;
    const Image even(16, 16, 1.0F);
    const FacePlan plan{{19, 19}, {17, 17}, 20.0, 1.0};
    const RayBundle rays =
        two_plane_map({first, even}, {second, even}, {16, 16}, 21.0, Executor::serial(), {});
    const LensFaces faces = faces_along(rays, first, plan);
    EXPECT_LE(faces.front.maxCoeff(), 0.0);
    EXPECT_GE(faces.exit.row(2).minCoeff(), plan.thickness);

    OpticalSetup behind = first;
    behind.front = height_front(faces.front, first.lens_size);
    const LightSource light(behind);
    const ControlNet net{plan.net, faces.exit};
    for (Eigen::Index k = 0; k < rays.entry.cols(); ++k) {
      const Eigen::Vector3d a = rays.first.col(k);
      const Eigen::Vector3d b = rays.second.col(k);
      const Eigen::Vector2d uv = 16.0 / 20.0 * rays.exit.col(k);
      const SplineFrame at = net.at(uv.cwiseMax(0.0).cwiseMin(16.0));
      const IncidentRay ray = ray_through_front(light.front(), light.before_front(), at.point);
      ASSERT_TRUE(ray.m.allFinite());
      EXPECT_LT((ray.x - rays.entry.col(k)).norm(), 0.1);
      const Eigen::Vector3d out = refract(ray.direction(), at.normal().normalized(), first.ior);
      const auto reaches = [&](double z) -> Eigen::Vector2d {
        return (at.point + (z - at.point.z()) / out.z() * out).head<2>();
      };
      EXPECT_LT((reaches(a.z()) - a.head<2>()).norm(), 0.06);
      EXPECT_LT((reaches(b.z()) - b.head<2>()).norm(), 0.2);
    }
  }
}

}  // namespace
}  // namespace lensforge
