// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/ball_cutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;

Eigen::Matrix3d triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
  Eigen::Matrix3d corners;
  corners << a, b, c;
  return corners;
}

/// f of ball_cutter.h in long double; outside the ball a slope that leads back under it, so that f
/// stays quasi-concave on the triangle.
long double height_at(const Eigen::Vector2d& p, const Eigen::Matrix3d& m, long double lb,
                      long double lc) {
  long double q[3];
  for (int k = 0; k < 3; ++k) {
    const long double a = m(k, 0);
    q[k] = a + lb * (m(k, 1) - a) + lc * (m(k, 2) - a);
  }
  const long double d = std::hypot(q[0] - p.x(), q[1] - p.y());
  const long double r = kRadius;
  return d <= r ? q[2] + std::sqrt(r * r - d * d) - r : -1000.0L - 1000.0L * (d - r);
}

/// Largest value of a quasi-concave function on [0, end], by ternary search.
template <class Function>
long double largest(long double end, const Function& f) {
  long double low = 0.0L;
  long double high = end;
  for (int i = 0; i < 80; ++i) {
    const long double left = low + (high - low) / 3.0L;
    const long double right = high - (high - low) / 3.0L;
    if (f(left) < f(right)) {
      low = left;
    } else {
      high = right;
    }
  }
  return std::max({f(low), f(0.0L), f(end)});
}

/// The definition itself: the largest f over all points of the triangle.
double slow_triangle_tip(const Eigen::Vector2d& p, const Eigen::Matrix3d& m) {
  const long double best = largest(1.0L, [&](long double lb) {
    return largest(1.0L - lb, [&](long double lc) { return height_at(p, m, lb, lc); });
  });
  return best <= -1000.0L ? kNoContact : static_cast<double>(best);
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double in(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Eigen::Vector3d point(double side, double height) {
    return {in(-side, side), in(-side, side), in(-height, height)};
  }

 private:
  std::mt19937_64 engine_;
};

TEST(BallCutter, RestsOnAVertexLikeOnASphere) {
  const Eigen::Vector3d q(1.0, 2.0, 3.0);
  EXPECT_DOUBLE_EQ(vertex_tip({1.0, 2.0}, kRadius, q), 3.0);
  EXPECT_NEAR(vertex_tip({1.12, 2.0}, kRadius, q), 3.0 + 0.16 - 0.2, 1e-15);
  EXPECT_NEAR(vertex_tip({1.0, 2.0 + kRadius - 1e-12}, kRadius, q), 2.8, 1e-6);
  EXPECT_EQ(vertex_tip({1.0, 2.21}, kRadius, q), kNoContact);
}

TEST(BallCutter, RestsOnAPlaneByItsSlope) {
  for (const double slope : {0.0, 0.1, 0.5, 1.0, 3.0}) {
    const auto m = triangle({-5, -5, -5 * slope}, {5, -5, 5 * slope}, {0, 9, 0});
    const double secant = std::sqrt(1.0 + slope * slope);
    for (const double x : {-0.7, 0.0, 0.4}) {
      EXPECT_NEAR(triangle_tip({x, 0.1}, kRadius, m), slope * x + kRadius * (secant - 1.0), 1e-14);
    }
  }
}

TEST(BallCutter, RestsOnAnEdgeAsACylinderSection) {
  // A thin vertical fin: only its upper edge, falling at slope −0.5 along x, can hold the ball.
  const auto m = triangle({-5, 0, 2.5}, {5, 0, -2.5}, {0, 0, -9});
  const double secant = std::sqrt(1.25);
  for (const double y : {0.0, 0.05, -0.15}) {
    const double r = std::sqrt(kRadius * kRadius - y * y);
    EXPECT_NEAR(triangle_tip({0.3, y}, kRadius, m), -0.15 + r * secant - kRadius, 1e-14);
  }
}

TEST(BallCutter, SlidesOffAVerticalWallAtItsUpperEdge) {
  const auto m = triangle({0, -5, 1}, {0, 5, 1}, {0, 0, -3});
  EXPECT_NEAR(triangle_tip({0.12, 0.0}, kRadius, m), 1.0 + 0.16 - 0.2, 1e-15);
  EXPECT_EQ(triangle_tip({0.2000001, 0.0}, kRadius, m), kNoContact);
}

TEST(BallCutter, OrientationDoesNotMatter) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto a = random.point(0.3, 0.2);
    const auto b = random.point(0.3, 0.2);
    const auto c = random.point(0.3, 0.2);
    const Eigen::Vector2d p(random.in(-0.3, 0.3), random.in(-0.3, 0.3));
    const double tip = triangle_tip(p, kRadius, triangle(a, b, c));
    const double turned = triangle_tip(p, kRadius, triangle(a, c, b));
    if (tip == kNoContact) {
      EXPECT_EQ(turned, kNoContact);
    } else {
      EXPECT_NEAR(tip, turned, 1e-12);
    }
  }
}

TEST(BallCutter, AgreesWithTheDefinition) {
  Random random(2);
  int contacts = 0;
  for (int i = 0; i < 600; ++i) {
    const double side = i % 3 == 0 ? 0.05 : i % 3 == 1 ? 0.3 : 3.0;
    const auto m = triangle(random.point(side, 0.3 * side), random.point(side, 0.3 * side),
                            random.point(side, 0.3 * side));
    const Eigen::Vector2d p(random.in(-side, side), random.in(-side, side));
    const double slow = slow_triangle_tip(p, m);
    const double tip = triangle_tip(p, kRadius, m);
    if (slow == kNoContact) {
      EXPECT_EQ(tip, kNoContact);
      continue;
    }
    ++contacts;
    EXPECT_NEAR(tip, slow, 1e-12) << "case " << i;
  }
  EXPECT_GT(contacts, 200);
}

TEST(BallCutter, SteepAndThinFacetsAgreeWithTheDefinitionNearby) {
  // Where the height depends on p by more than 10 digits, the answer has to lie between the exact
  // answers for points within 1e-12 mm.
  Random random(3);
  int contacts = 0;
  for (int i = 0; i < 160; ++i) {
    const double flat = std::pow(10.0, -random.in(1.0, 9.0));
    Eigen::Vector3d a = random.point(0.2, 0.5);
    Eigen::Vector3d b = random.point(0.2, 0.5);
    Eigen::Vector3d c = a + random.in(-0.2, 1.2) * (b - a) + flat * random.point(1.0, 1.0);
    if (i % 2 == 0) c.z() = random.in(-0.5, 0.5);
    const auto m = triangle(a, b, c);
    const Eigen::Vector2d p(random.in(-0.3, 0.3), random.in(-0.3, 0.3));
    double low = slow_triangle_tip(p, m);
    double high = low;
    for (const Eigen::Vector2d& d : {Eigen::Vector2d(1e-12, 0), Eigen::Vector2d(-1e-12, 0),
                                     Eigen::Vector2d(0, 1e-12), Eigen::Vector2d(0, -1e-12)}) {
      const double near = slow_triangle_tip(p + d, m);
      low = std::min(low, near);
      high = std::max(high, near);
    }
    const double tip = triangle_tip(p, kRadius, m);
    EXPECT_GE(tip, low - 1e-12) << "case " << i;
    EXPECT_LE(tip, high + 1e-12) << "case " << i;
    if (tip > kNoContact) ++contacts;
  }
  EXPECT_GT(contacts, 50);
}

}  // namespace
}  // namespace lensforge
