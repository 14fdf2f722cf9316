// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "design/finite_difference.h"
#include "design/random_corners.h"
#include "design/random_input.h"
#include "design/snell.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::random_corners;

const Eigen::Vector3d kPlace(40.0, 30.0, 5.0);

OpticalSetup shifted_setup() {
  OpticalSetup setup;
  setup.lens_size = {100.0, 80.0};
  setup.pixels = {50, 20};
  setup.image_size = {200.0, 60.0};
  setup.image_origin = {-30.0, 12.0};
  return setup;
}

OpticalSetup oblique_setup() {
  OpticalSetup setup = shifted_setup();
  setup.light = Eigen::Vector3d(0.3, -0.2, 1.0).normalized();
  return setup;
}

/// Light along +z, and from a side.
class EveryLight : public ::testing::TestWithParam<bool> {
 protected:
  const OpticalSetup setup_ = GetParam() ? oblique_setup() : shifted_setup();
  const LightPath light_{setup_};

  /// A normal up to 0.4 rad away from the light.
  [[nodiscard]] Eigen::Vector3d random_normal(Random& random) const {
    return (light_.incident(kPlace) + 0.4 * random.between(0.0, 1.0) * random.near_z(3.1))
        .normalized();
  }
};

INSTANTIATE_TEST_SUITE_P(LightPath, EveryLight, ::testing::Values(false, true),
                         [](const auto& kind) -> std::string {
                           return kind.param ? "Oblique" : "AlongZ";
                         });

TEST(LightPath, FrontViewRunsXAndYAgainstColumnsAndRows) {
  const LightPath light(shifted_setup());
  // x = origin.x + size.x − u·px, y = origin.y + size.y − v·py.
  const Eigen::Vector2d u = light.land(kPlace, {0.1, -0.02});
  const double x = 40.0 + 295.0 * 0.1;
  const double y = 30.0 - 295.0 * 0.02;
  EXPECT_NEAR(u.x(), (-30.0 + 200.0 - x) / 4.0, 1e-12);
  EXPECT_NEAR(u.y(), (12.0 + 60.0 - y) / 3.0, 1e-12);
}

TEST(LightPath, RearViewMirrorsX) {
  OpticalSetup setup = shifted_setup();
  const Eigen::Vector2d front = LightPath(setup).land(kPlace, {0.1, -0.02});
  setup.view = ViewSide::kRear;
  const Eigen::Vector2d rear = LightPath(setup).land(kPlace, {0.1, -0.02});
  EXPECT_NEAR(rear.x(), 50.0 - front.x(), 1e-12);
  EXPECT_EQ(rear.y(), front.y());
}

TEST_P(EveryLight, IsRefractedTwiceBySnellsLaw) {
  Random random(2);
  const Eigen::Vector3d inside =
      testing::refract_by_angles(setup_.light, Eigen::Vector3d::UnitZ(), 1.0 / setup_.ior);
  EXPECT_LT((light_.incident(kPlace) - inside).norm(), 1e-15);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d n = random_normal(random);
    const Eigen::Vector3d b = testing::refract_by_angles(inside, n, setup_.ior);
    EXPECT_LT((light_.beam(kPlace, n).m - b.head<2>() / b.z()).norm(), 1e-13);
  }
}

TEST_P(EveryLight, IsTransmittedUpToTheCriticalAngle) {
  const double critical = std::asin(1.0 / 1.49);
  const Eigen::Vector3d a = light_.incident(kPlace);
  const Eigen::Vector3d axis = a.cross(Eigen::Vector3d::UnitX()).normalized();
  const auto tilted = [&](double angle) -> Eigen::Vector3d {
    return Eigen::AngleAxisd(angle, axis) * a;
  };
  const Corners t = {kPlace, kPlace, kPlace};
  EXPECT_TRUE(light_.transmits(kPlace, tilted(0.0)));
  EXPECT_TRUE(light_.transmits(t, tilted(1e-9 - critical)));
  EXPECT_TRUE(std::isfinite(light_.barrier(t, tilted(1e-9 - critical))));
  EXPECT_FALSE(light_.transmits(t, tilted(-1e-9 - critical)));
  EXPECT_EQ(light_.barrier(t, tilted(-1e-9 - critical)), kInfinity);
  EXPECT_FALSE(light_.transmits(kPlace, tilted(3.1)));
}

TEST_P(EveryLight, BarrierAdjointEqualsCentralDifferences) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random_normal(random);
    const auto f = [&](const Eigen::VectorXd& x) {
      return 0.7 * light_.barrier(t, Eigen::Vector3d(x));
    };
    Corners ignored;
    Eigen::Vector3d n_bar = Eigen::Vector3d::Zero();
    EXPECT_EQ(light_.barrier_adjoint(t, n, 0.7, ignored, n_bar), light_.barrier(t, n));
    EXPECT_LT(testing::plateau_error(n_bar, f, n, 3e-4), 1e-8);
  }
}

TEST_P(EveryLight, BeamAdjointEqualsCentralDifferences) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d n = random_normal(random);
    const Eigen::Vector2d m_bar = random.vector2();
    const auto f = [&](const Eigen::VectorXd& x) {
      return m_bar.dot(light_.beam(kPlace, Eigen::Vector3d(x)).m);
    };
    Eigen::Vector3d ignored = Eigen::Vector3d::Zero();
    const Eigen::Vector3d n_bar =
        light_.beam_adjoint(kPlace, n, light_.beam(kPlace, n), m_bar, ignored);
    EXPECT_LT(testing::plateau_error(n_bar, f, n, 3e-4), 1e-8);
  }
}

TEST_P(EveryLight, LandAdjointEqualsCentralDifferences) {
  Random random(1);
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    OpticalSetup setup = setup_;
    setup.view = view;
    const LightPath light(setup);
    for (int i = 0; i < 100; ++i) {
      Eigen::VectorXd x(5);
      x << 50.0 * random.vector3(), 0.3 * random.vector2();
      const Eigen::Vector2d u_bar = random.vector2();
      const auto f = [&](const Eigen::VectorXd& at) {
        return u_bar.dot(light.land(at.head<3>(), at.tail<2>()));
      };
      Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
      Eigen::Vector2d m_bar = Eigen::Vector2d::Zero();
      light.land_adjoint(x.head<3>(), x.tail<2>(), u_bar, p_bar, m_bar);
      Eigen::VectorXd computed(5);
      computed << p_bar, m_bar;
      EXPECT_LT(testing::plateau_error(computed, f, x, 1e-2), 1e-9);
    }
  }
}

TEST(LightPath, LandAdjointAddsToWhatIsThere) {
  const LightPath light(shifted_setup());
  Eigen::Vector3d p_bar(1.0, 2.0, 3.0);
  Eigen::Vector2d m_bar(4.0, 5.0);
  light.land_adjoint({1.0, 2.0, 5.0}, {0.1, 0.2}, {0.0, 0.0}, p_bar, m_bar);
  EXPECT_EQ(p_bar, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(m_bar, Eigen::Vector2d(4.0, 5.0));
}

TEST_P(EveryLight, FluxIsTheAreaThroughWhichTheRaysEnterTheLens) {
  Random random(5);
  const Eigen::Vector3d a = light_.incident(kPlace);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    const auto enters = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      return (p - p.z() / a.z() * a).head<2>();
    };
    const Eigen::Vector2d side = enters(t.v1) - enters(t.v0);
    const Eigen::Vector2d other = enters(t.v2) - enters(t.v0);
    const double area = 0.5 * (side.x() * other.y() - side.y() * other.x());
    EXPECT_NEAR(light_.intake(t), area, 1e-13);
    EXPECT_NEAR(light_.flux(t), area / 8000.0, 1e-17);
  }
}

TEST_P(EveryLight, FluxAdjointEqualsCentralDifferences) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Corners t = random_corners(random);
    const auto f = [&](const Eigen::VectorXd& x) {
      return 0.7 * light_.flux(testing::unpack_corners(x));
    };
    Corners t_bar;
    Eigen::Vector3d area_normal_bar = Eigen::Vector3d::Zero();
    light_.flux_adjoint(t, 0.7, t_bar, area_normal_bar);
    area_normal_adjoint(t, area_normal_bar, t_bar);
    EXPECT_LT(testing::plateau_error(testing::pack(t_bar), f, testing::pack(t), 1e-2), 1e-9);
  }
}

TEST_P(EveryLight, ASurfaceOfTheWantedGradientSendsItsLightThere) {
  Random random(7);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d n = random_normal(random);
    const Eigen::Vector2d pixel = light_.land(kPlace, light_.beam(kPlace, n).m);
    const Eigen::Vector2d expected = -n.head<2>() / n.z();
    EXPECT_LT((light_.gradient_for(kPlace, pixel) - expected).norm(), 1e-11);
  }
}

TEST_P(EveryLight, AFlatLensLetsLightGoOnInItsDirection) {
  const Eigen::Vector2d way = setup_.light.head<2>() / setup_.light.z();
  const Eigen::Vector2d mm = kPlace.head<2>() + 295.0 * way;
  EXPECT_LT((light_.land_from_flat(kPlace) - light_.plane().to_pixels(mm)).norm(), 1e-12);
  const Eigen::Vector2d back = light_.place_on_flat(light_.land_from_flat(kPlace), 5.0);
  EXPECT_LT((back - kPlace.head<2>()).norm(), 1e-12);
}

TEST_P(EveryLight, ReachIsHowFarASlopeMovesTheLight) {
  const auto lands = [&](double x, double y) -> Eigen::Vector2d {
    const Eigen::Vector3d n = Eigen::Vector3d(-x, -y, 1.0).normalized();
    return light_.plane().to_mm(light_.land(kPlace, light_.beam(kPlace, n).m));
  };
  const double step = 1e-5;
  Eigen::Matrix2d motion;
  motion << (lands(step, 0.0) - lands(-step, 0.0)) / (2.0 * step),
      (lands(0.0, step) - lands(0.0, -step)) / (2.0 * step);
  EXPECT_NEAR(light_.reach(1.0, 5.0), std::sqrt(motion.determinant()), 1e-6);
}

TEST(LightPath, FormulasForLightAlongZAreTheGeneralOnes) {
  OpticalSetup setup = shifted_setup();
  const LightPath along_z(setup);
  setup.light = Eigen::Vector3d(1e-15, 0.0, 1.0);  // One in length, but not +z.
  const LightPath general(setup);
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_corners(random);
    const Eigen::Vector3d n = random.near_z(0.6);
    EXPECT_LT((along_z.beam(t.v0, n).m - general.beam(t.v0, n).m).norm(), 1e-13);
    EXPECT_NEAR(along_z.flux(t), general.flux(t), 1e-17);
    EXPECT_NEAR(along_z.barrier(t, n) / general.barrier(t, n), 1.0, 1e-12);
  }
  EXPECT_NEAR(along_z.reach(1.0), general.reach(1.0), 1e-10);
}

}  // namespace
}  // namespace lensforge
