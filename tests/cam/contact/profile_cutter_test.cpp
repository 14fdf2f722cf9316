// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/profile_cutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/ball_cutter.h"

namespace lensforge {
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double in(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Eigen::Matrix3d triangle(double side, double height) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) << in(0, side), in(0, side), in(0, height);
    return corners;
  }

 private:
  std::mt19937_64 engine_;
};

/// Ball, bull, flat, one with a flat part of a tenth, a shank above the tip, a skin around a bull.
std::vector<CutterProfile> profiles(double radius) {
  return {{radius, radius, 0.0}, {radius, 0.3 * radius, 0.0},
          {radius, 0.0, 0.0},    {radius, 0.9 * radius, 0.0},
          {radius, 0.0, 0.7},    grown({radius, 0.3 * radius, 0.0}, 0.2 * radius)};
}

/// f at λ_a·a + λ_b·b + λ_c·c, straight from its definition.
double lift(const CutterProfile& profile, const Eigen::Vector2d& p, const Eigen::Matrix3d& corners,
            double b, double c) {
  const Eigen::Vector3d q =
      (1.0 - b - c) * corners.col(0) + b * corners.col(1) + c * corners.col(2);
  const double away = (q.head<2>() - p).norm();
  return away <= profile.radius ? q.z() - profile.height(away) : kNoContact;
}

/// The largest f over a triangle by sampling it, again and again around the best sample. Never
/// above the truth; below it by what the last samples are apart.
double sampled_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                   const Eigen::Matrix3d& corners) {
  constexpr int kSteps = 16;
  double best = kNoContact;
  double best_b = 0.25;
  double best_c = 0.25;
  for (double width = 1.0; width > 1e-8; width *= best == kNoContact ? 0.9 : 0.6) {
    const double centre_b = best == kNoContact ? 0.5 : best_b;
    const double centre_c = best == kNoContact ? 0.5 : best_c;
    if (best == kNoContact && width < 0.2) return best;
    for (int i = -kSteps; i <= kSteps; ++i) {
      for (int j = -kSteps; j <= kSteps; ++j) {
        const double size = best == kNoContact ? 1.0 : width;
        const double b = std::fmin(std::fmax(centre_b + 0.5 * size * i / kSteps, 0.0), 1.0);
        const double c = std::fmin(std::fmax(centre_c + 0.5 * size * j / kSteps, 0.0), 1.0 - b);
        const double tip = lift(profile, p, corners, b, c);
        if (tip > best) {
          best = tip;
          best_b = b;
          best_c = c;
        }
      }
    }
  }
  return best;
}

double brute_force(const SurfaceMesh& mesh, const CutterProfile& profile,
                   const Eigen::Vector2d& p) {
  double best = kNoContact;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    Eigen::Matrix3d corners;
    corners << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
    best = std::fmax(best, profile_triangle_tip(profile, p, corners));
  }
  return best;
}

TEST(ProfileContact, AgreesWithDenseSampling) {
  Random random(1);
  int touched = 0;
  for (int round = 0; round < 60; ++round) {
    const double height = std::pow(10.0, random.in(-2.0, 0.5));
    const Eigen::Matrix3d corners = random.triangle(1.0, height);
    for (const CutterProfile& profile : profiles(random.in(0.2, 0.8))) {
      const Eigen::Vector2d p(random.in(-0.3, 1.3), random.in(-0.3, 1.3));
      const double exact = profile_triangle_tip(profile, p, corners);
      const double sampled = sampled_tip(profile, p, corners);
      EXPECT_LE(sampled, exact + 1e-12) << round;
      if (sampled == kNoContact) continue;
      ++touched;
      // The sampling can end beside a maximum that lies on the rim of a flat disc.
      EXPECT_GE(sampled, exact - 1e-3 * (1.0 + height)) << round << " " << profile.corner;
    }
  }
  EXPECT_GT(touched, 200);
}

TEST(ProfileContact, AgreesWithTheBall) {
  Random random(2);
  for (int round = 0; round < 20000; ++round) {
    const double radius = random.in(0.1, 1.0);
    const Eigen::Matrix3d corners = random.triangle(1.0, std::pow(10.0, random.in(-3.0, 0.3)));
    const Eigen::Vector2d p(random.in(-0.5, 1.5), random.in(-0.5, 1.5));
    const double expected = triangle_tip(p, radius, corners);
    const double tip = profile_triangle_tip({radius, radius, 0.0}, p, corners);
    if (expected == kNoContact) {
      EXPECT_EQ(tip, kNoContact);
    } else {
      EXPECT_NEAR(tip, expected, 1e-12) << round;
    }
  }
}

TEST(ProfileContact, EdgeIsTheMaximumByGoldenSection) {
  // On a segment f is concave where it is finite: golden-section search over that part.
  Random random(3);
  for (int round = 0; round < 3000; ++round) {
    const CutterProfile profile =
        profiles(random.in(0.2, 0.8))[static_cast<std::size_t>(round % 6)];
    const Eigen::Matrix3d ends = random.triangle(1.5, std::pow(10.0, random.in(-3.0, 1.0)));
    const Eigen::Vector2d p(random.in(0.0, 1.5), random.in(0.0, 1.5));
    const Eigen::Vector3d a = ends.col(0);
    const Eigen::Vector3d u = ends.col(1) - a;
    const double tip = profile_edge_tip(profile, p, a, ends.col(1));
    const double run = u.head<2>().norm();
    const double foot = (p - a.head<2>()).dot(u.head<2>()) / (run * run);
    const double away = (a.head<2>() + foot * u.head<2>() - p).norm();
    if (away >= profile.radius) {
      EXPECT_EQ(tip, kNoContact);
      continue;
    }
    const double half = std::sqrt(profile.radius * profile.radius - away * away) / run;
    double low = std::fmax(0.0, foot - half);
    double high = std::fmin(1.0, foot + half);
    if (low > high) {
      EXPECT_EQ(tip, kNoContact);
      continue;
    }
    const auto f = [&](double s) {
      const Eigen::Vector3d q = a + s * u;
      return q.z() - profile.height(std::fmin((q.head<2>() - p).norm(), profile.radius));
    };
    for (int step = 0; step < 80; ++step) {
      const double third = 0.381966 * (high - low);
      (f(low + third) < f(high - third) ? low : high) +=
          f(low + third) < f(high - third) ? third : -third;
    }
    EXPECT_NEAR(tip, f(0.5 * (low + high)), 1e-9) << round;
    EXPECT_EQ(tip, profile_edge_tip(profile, p, ends.col(1), a));
  }
}

TEST(ProfileContact, TangentToAPlaneByItsNormal) {
  // On a plane of slope m under p at height z a bull of radius R and corner c rests at
  // z + m(R − c) + c(√(1 + m²) − 1).
  const CutterProfile bull{1.5, 0.4, 0.0};
  Eigen::Matrix3d corners;
  const double slope = 0.3;
  corners.col(0) << -50.0, -50.0, -50.0 * slope;
  corners.col(1) << 80.0, -50.0, 80.0 * slope;
  corners.col(2) << -50.0, 90.0, -50.0 * slope;
  const double expected = 2.0 * slope + slope * 1.1 + 0.4 * (std::hypot(1.0, slope) - 1.0);
  EXPECT_NEAR(profile_triangle_tip(bull, {2.0, 1.0}, corners), expected, 1e-13);
}

TEST(ProfileContact, BoxHoldsUpLikeItsTwoTriangles) {
  Random random(4);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(0.0, 0.0, -1.0), Eigen::Vector3d(1.0, 0.6, 0.5));
  Eigen::Matrix3d lower;
  Eigen::Matrix3d upper;
  lower << 0.0, 1.0, 1.0, 0.0, 0.0, 0.6, 0.5, 0.5, 0.5;
  upper << 0.0, 1.0, 0.0, 0.0, 0.6, 0.6, 0.5, 0.5, 0.5;
  for (int round = 0; round < 2000; ++round) {
    const CutterProfile profile = profiles(0.4)[static_cast<std::size_t>(round % 6)];
    const Eigen::Vector2d p(random.in(-0.5, 1.5), random.in(-0.5, 1.1));
    const double triangles =
        std::fmax(profile_triangle_tip(profile, p, lower), profile_triangle_tip(profile, p, upper));
    const double tip = profile_box_tip(profile, p, box);
    if (tip == kNoContact) {
      EXPECT_EQ(triangles, kNoContact);
    } else {
      EXPECT_NEAR(tip, triangles, 1e-9);
    }
  }
}

void expect_equal_to_brute_force(const SurfaceMesh& mesh, int points, Random& random) {
  const ProfileCutter cutter(mesh);
  CutterLocation last;
  for (int i = 0; i < points; ++i) {
    const CutterProfile profile = profiles(random.in(0.05, 0.9))[static_cast<std::size_t>(i % 6)];
    Eigen::Vector2d p(random.in(-0.9, 3.0), random.in(-0.9, 3.0));
    if (i % 5 == 1) p = mesh.vertices.col(i % mesh.vertex_count()).head<2>();
    const CutterLocation fresh = cutter.drop(profile, p);
    const double expected = brute_force(mesh, profile, p);
    EXPECT_LE(cutter.rest_on(profile, p, last), std::fmax(expected + 1e-12, kNoContact)) << i;
    last = cutter.drop(profile, p, last);
    if (expected == kNoContact) {
      EXPECT_FALSE(fresh.rests());
      EXPECT_FALSE(last.rests());
      last = {};
    } else {
      EXPECT_NEAR(fresh.tip, expected, 1e-12) << i;
      EXPECT_NEAR(last.tip, expected, 1e-12) << i;
      EXPECT_NEAR(cutter.rest_on(profile, p, fresh), expected, 1e-12) << i;
    }
  }
}

TEST(ProfileCutter, EqualsBruteForceOnRandomReliefs) {
  Random random(5);
  for (int round = 0; round < 10; ++round) {
    const double height = std::pow(10.0, random.in(-4.0, 1.0));
    const SurfaceMesh mesh = testing::grid_mesh(
        14, 11, 2.0, 1.7, [&](double, double) { return random.in(0.0, height); });
    expect_equal_to_brute_force(mesh, 240, random);
  }
}

TEST(ProfileCutter, EqualsBruteForceOnHugeBesideTinySoup) {
  Random random(6);
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 900);
  mesh.triangles.resize(3, 300);
  for (int t = 0; t < 300; ++t) {
    const double size = t % 50 == 0 ? 20.0 : t % 4 == 0 ? 1.0 : 0.02;
    Eigen::Matrix3d corners = random.triangle(size, 0.2 * size);
    corners.colwise() += Eigen::Vector3d(random.in(0.0, 2.0), random.in(0.0, 2.0), 0.0);
    mesh.vertices.middleCols<3>(3 * t) = corners;
    mesh.triangles.col(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  }
  expect_equal_to_brute_force(mesh, 1200, random);
}

TEST(ProfileCutter, AnswersTheSurfaceItselfForANeedle) {
  const SurfaceMesh mesh = testing::grid_mesh(
      5, 5, 4.0, 4.0, [](double x, double y) { return 1.0 + 0.3 * x - 0.2 * y; });
  const ProfileCutter cutter(mesh);
  for (const double x : {0.0, 0.31, 1.0, 2.77, 4.0}) {
    EXPECT_NEAR(cutter.drop({}, {x, 1.9}).tip, 1.0 + 0.3 * x - 0.38, 1e-12);
  }
  EXPECT_FALSE(cutter.drop({}, {4.1, 1.9}).rests());
  EXPECT_FALSE(ProfileCutter(SurfaceMesh{}).drop({1.0, 1.0, 0.0}, {0.0, 0.0}).rests());
}

}  // namespace
}  // namespace lensforge
