// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/projection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::Random;
using testing::setup_of;

OpticalSetup shifted_setup() {
  OpticalSetup setup = setup_of({100.0, 80.0}, {50, 20}, 300.0);
  setup.image_size = {200.0, 60.0};
  setup.image_origin = {-30.0, 12.0};
  return setup;
}

TEST(Projection, FrontViewRunsXAndYAgainstColumnsAndRows) {
  const Projection optics(shifted_setup());
  // interface.md: x = origin.x + size.x − u·px, y = origin.y + size.y − v·py.
  const Eigen::Vector2d u = optics.land({40.0, 30.0, 5.0}, {0.1, -0.02});
  const double x = 40.0 + 295.0 * 0.1;
  const double y = 30.0 - 295.0 * 0.02;
  EXPECT_NEAR(u.x(), (-30.0 + 200.0 - x) / 4.0, 1e-12);
  EXPECT_NEAR(u.y(), (12.0 + 60.0 - y) / 3.0, 1e-12);
}

TEST(Projection, RearViewMirrorsX) {
  OpticalSetup setup = shifted_setup();
  const Eigen::Vector2d front = Projection(setup).land({40.0, 30.0, 5.0}, {0.1, -0.02});
  setup.view = ViewSide::kRear;
  const Eigen::Vector2d rear = Projection(setup).land({40.0, 30.0, 5.0}, {0.1, -0.02});
  EXPECT_NEAR(rear.x(), 50.0 - front.x(), 1e-12);
  EXPECT_EQ(rear.y(), front.y());
}

TEST(Projection, TransmitsUpToTheCriticalAngle) {
  const Projection optics(shifted_setup());
  const double critical = std::asin(1.0 / 1.49);
  const auto tilted = [](double angle) {
    return Eigen::Vector3d(std::sin(angle), 0.0, std::cos(angle));
  };
  EXPECT_TRUE(optics.transmits(tilted(0.0)));
  EXPECT_TRUE(optics.transmits(tilted(critical - 1e-9)));
  EXPECT_FALSE(optics.transmits(tilted(critical + 1e-9)));
  EXPECT_FALSE(optics.transmits(tilted(3.1)));
}

TEST(Projection, LandAdjointEqualsCentralDifferences) {
  Random random(1);
  for (const ViewSide view : {ViewSide::kFront, ViewSide::kRear}) {
    OpticalSetup setup = shifted_setup();
    setup.view = view;
    const Projection optics(setup);
    for (int i = 0; i < 100; ++i) {
      Eigen::VectorXd x(5);
      x << 50.0 * random.vector3(), 0.3 * random.vector2();
      const Eigen::Vector2d u_bar = random.vector2();
      const auto f = [&](const Eigen::VectorXd& at) {
        return u_bar.dot(optics.land(at.head<3>(), at.tail<2>()));
      };
      Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
      Eigen::Vector2d m_bar = Eigen::Vector2d::Zero();
      optics.land_adjoint(x.head<3>(), x.tail<2>(), u_bar, p_bar, m_bar);
      Eigen::VectorXd computed(5);
      computed << p_bar, m_bar;
      EXPECT_LT(testing::plateau_error(computed, f, x, 1e-2), 1e-9);
    }
  }
}

TEST(Projection, LandAdjointAddsToWhatIsThere) {
  const Projection optics(shifted_setup());
  Eigen::Vector3d p_bar(1.0, 2.0, 3.0);
  Eigen::Vector2d m_bar(4.0, 5.0);
  optics.land_adjoint({1.0, 2.0, 5.0}, {0.1, 0.2}, {0.0, 0.0}, p_bar, m_bar);
  EXPECT_EQ(p_bar, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(m_bar, Eigen::Vector2d(4.0, 5.0));
}

}  // namespace
}  // namespace lensforge
