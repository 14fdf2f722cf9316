// SPDX-License-Identifier: GPL-3.0-or-later
// A third model of surfaces: cam asks the interface, so that it is cut and predicted as it is.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "cam/cam_meshes.h"
#include "cam/milled_tiles.h"
#include "cam/predict/part_surfaces.h"

namespace lensforge::meant_surface_test {
namespace {

constexpr double kRadius = 0.2;
constexpr double kBend = 2.0;  ///< 1/mm: a bowl that the ball fits into.
constexpr double kSide = 2.0;

/// z = 5 + kBend/2 · |q − c|², c being the middle.
class Bowl final : public OpticalSurface {
 public:
  Bowl() : OpticalSurface(testing::grid_mesh(9, 9, kSide, kSide, height)) {}

  static double height(double x, double y) { return polar({x, y}, {x, y}); }

  [[nodiscard]] bool has_creases() const override { return false; }
  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override {
    const Eigen::Vector2d q = corners(triangle) * weights;
    return {polar(q, q), kBend * (q - middle())};
  }
  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& /*weights*/) const override {
    const Eigen::Matrix<double, 2, 3> p = corners(triangle);
    const auto b = [&](int i, int j, int k) {
      return (polar(p.col(i), p.col(j)) + polar(p.col(j), p.col(k)) + polar(p.col(k), p.col(i))) /
             3.0;
    };
    return {{p.col(0), p.col(1), p.col(2)},
            {b(0, 0, 0), b(1, 1, 1), b(2, 2, 2), b(0, 0, 1), b(0, 1, 1), b(0, 0, 2), b(1, 1, 2),
             b(0, 1, 2), b(0, 2, 2), b(1, 2, 2)}};
  }
  [[nodiscard]] BendRange bend_range(std::int64_t /*triangle*/) const override {
    return {kBend, kBend};
  }

  static Eigen::Vector2d middle() { return Eigen::Vector2d::Constant(0.5 * kSide); }

 private:
  /// The polar form: its values at corners are the Bernstein coefficients.
  static double polar(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return 5.0 + 0.5 * kBend * (p - middle()).dot(q - middle());
  }
  [[nodiscard]] Eigen::Matrix<double, 2, 3> corners(std::int64_t triangle) const {
    Eigen::Matrix<double, 2, 3> p;
    for (int k = 0; k < 3; ++k) p.col(k) = mesh().corner(triangle, k).head<2>();
    return p;
  }
};

/// Of a ball whose axis is `r` away from the middle: of the contacts of the profile, the highest.
double tip_of(double r) {
  double best = -HUGE_VAL;
  for (double q = r - kRadius; q < r + kRadius; q += 1e-6) {
    const double s = std::sqrt(std::max(0.0, kRadius * kRadius - (q - r) * (q - r)));
    best = std::max(best, 5.0 + 0.5 * kBend * q * q + s - kRadius);
  }
  return best;
}

TEST(MeantSurface, AnotherModelIsCutWithinTheToleranceAsItIs) {
  const auto cut = surface_to_cut(std::make_shared<const Bowl>(), kRadius, Executor::serial());
  ASSERT_NE(cut->bed(), nullptr);
  SmoothRoll ball(*cut->bed(), {0, 0.5 * kSide});
  const auto nodes = ball.follow(1.3, 1.304, 1e-7);
  ASSERT_TRUE(nodes);
  EXPECT_NEAR(nodes->z.front(), tip_of(0.3), 1e-9);
  EXPECT_NEAR(nodes->z.back(), tip_of(0.304), 1e-9);
}

TEST(MeantSurface, AnotherModelIsPredictedAsItIs) {
  const auto bowl = std::make_shared<const Bowl>();
  const auto meant = meant_surface(bowl);
  const SurfacePatch patch =
      testing::sampled(meant->field(), testing::window_at({0.0, 0.0}, 0.04, 51, 51));
  EXPECT_TRUE(patch.cut.empty());
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 51, n / 51);
    const Eigen::Vector2d slope = kBend * (q - Bowl::middle());
    const auto i = static_cast<std::size_t>(n);
    ASSERT_NEAR(patch.z[i], Bowl::height(q.x(), q.y()), 1e-12);
    ASSERT_NEAR(patch.slope_x[i], slope.x(), 1e-11);
    ASSERT_NEAR(patch.slope_y[i], slope.y(), 1e-11);
  }
  // The ball reaches all of a bowl that is wider than itself.
  const auto cut = surface_to_cut(bowl, kRadius, Executor::serial());
  const auto rounded = meant->rounded(*cut, bowl->box(), Executor::serial());
  EXPECT_EQ(testing::sampled(*rounded, patch.window).z, patch.z);
}

}  // namespace
}  // namespace lensforge::meant_surface_test
