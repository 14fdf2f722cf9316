// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/drop_cutter.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "cam/cam_meshes.h"

namespace lensforge::drop_cutter_test {
namespace {

constexpr double kRadius = 0.2;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double in(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int below(int end) { return std::uniform_int_distribution<int>(0, end - 1)(engine_); }
  Eigen::Vector3d point(double side, double height) {
    return {in(0.0, side), in(0.0, side), in(0.0, height)};
  }

 private:
  std::mt19937_64 engine_;
};

double brute_force(const SurfaceMesh& mesh, const Eigen::Vector2d& p, double radius) {
  double best = kNoContact;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    Eigen::Matrix3d corners;
    corners << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
    best = std::fmax(best, triangle_tip(p, radius, corners));
  }
  return best;
}

/// Compares the index with brute force at `points` places over the mesh and a little beside it,
/// half of them exactly over vertices or edges.
void expect_equal_to_brute_force(const SurfaceMesh& mesh, double radius, int points,
                                 Random& random) {
  const DropCutter cutter(mesh, radius, Executor::serial());
  const Eigen::AlignedBox3d& box = cutter.bounds();
  CutterLocation last;
  for (int i = 0; i < points; ++i) {
    Eigen::Vector2d p(random.in(box.min().x() - radius, box.max().x() + radius),
                      random.in(box.min().y() - radius, box.max().y() + radius));
    if (i % 2 == 1) {
      const int t = random.below(static_cast<int>(mesh.triangle_count()));
      const double along = i % 4 == 1 ? 0.0 : random.in(0.0, 1.0);
      p = (mesh.corner(t, 0) + along * (mesh.corner(t, 1) - mesh.corner(t, 0))).head<2>();
    }
    last = cutter.drop(p, last);
    const double expected = brute_force(mesh, p, radius);
    if (expected == kNoContact) {
      EXPECT_FALSE(last.rests());
    } else {
      EXPECT_NEAR(last.tip, expected, 1e-12) << "point " << i << " at " << p.transpose();
    }
  }
}

/// Triangles without common vertices: `corners` yields the three corners of each.
template <class Corners>
SurfaceMesh soup(int count, const Corners& corners) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3 * count);
  mesh.triangles.resize(3, count);
  for (int t = 0; t < count; ++t) {
    const Eigen::Matrix3d m = corners(t);
    mesh.vertices.middleCols<3>(3 * t) = m;
    mesh.triangles.col(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  }
  return mesh;
}

TEST(DropCutter, EqualsBruteForceOnRandomReliefs) {
  Random random(1);
  for (int round = 0; round < 12; ++round) {
    const double height = std::pow(10.0, random.in(-4.0, 1.0));
    SurfaceMesh mesh = testing::grid_mesh(14, 11, 2.0, 1.7,
                                          [&](double, double) { return random.in(0.0, height); });
    for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
      mesh.vertices.col(v).head<2>() +=
          0.3 * Eigen::Vector2d(random.in(-0.1, 0.1), random.in(-0.1, 0.1));
    }
    expect_equal_to_brute_force(mesh, random.in(0.02, 0.9), 300, random);
  }
}

TEST(DropCutter, EqualsBruteForceOnRandomSoup) {
  Random random(2);
  for (int round = 0; round < 12; ++round) {
    const double size = std::pow(10.0, random.in(-2.0, 0.5));
    const SurfaceMesh mesh = soup(250, [&](int) {
      const Eigen::Vector3d at = random.point(2.0, 1.0);
      Eigen::Matrix3d m;
      m << at, at + random.point(size, size), at + random.point(size, size);
      return m;
    });
    expect_equal_to_brute_force(mesh, random.in(0.05, 0.5), 200, random);
  }
}

TEST(DropCutter, EqualsBruteForceOnSteepFacets) {
  // Walls that lean by 1e-1 … 1e-14 of their height, closed to a mesh with plateaus between them.
  Random random(3);
  for (int power = 1; power <= 14; ++power) {
    const double lean = std::pow(10.0, -power);
    SurfaceMesh mesh = testing::grid_mesh(12, 6, 2.2, 1.0, [](double, double) { return 0.0; });
    for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
      const int column = static_cast<int>(v % 12);
      const int wall = column / 2;
      const int level = (column + 1) / 2 % 2;
      mesh.vertices(0, v) = 0.4 * wall + lean * (column % 2);
      mesh.vertices(2, v) = 0.7 * level + random.in(0.0, 0.01);
    }
    expect_equal_to_brute_force(mesh, kRadius, 200, random);
  }
}

TEST(DropCutter, EqualsBruteForceOnSlivers) {
  Random random(4);
  for (int power = 1; power <= 14; ++power) {
    const double thin = std::pow(10.0, -power);
    const SurfaceMesh mesh = soup(150, [&](int) {
      const Eigen::Vector3d a = random.point(2.0, 0.4);
      const Eigen::Vector3d b = random.point(2.0, 0.4);
      Eigen::Matrix3d m;
      m << a, b, a + random.in(-0.3, 1.3) * (b - a) + thin * random.point(1.0, 1.0);
      return m;
    });
    expect_equal_to_brute_force(mesh, kRadius, 150, random);
  }
}

TEST(DropCutter, EqualsBruteForceOnCoplanarNeighbours) {
  Random random(5);
  for (int round = 0; round < 6; ++round) {
    const double sx = random.in(-1.0, 1.0);
    const double sy = random.in(-1.0, 1.0);
    SurfaceMesh mesh = testing::grid_mesh(15, 15, 3.0, 3.0, [](double, double) { return 0.0; });
    for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
      mesh.vertices(0, v) += random.in(-0.08, 0.08);
      mesh.vertices(1, v) += random.in(-0.08, 0.08);
      mesh.vertices(2, v) = sx * mesh.vertices(0, v) + sy * mesh.vertices(1, v);
    }
    expect_equal_to_brute_force(mesh, kRadius, 300, random);
  }
}

TEST(DropCutter, EqualsBruteForceOnDoubledAndEmptyTriangles) {
  Random random(6);
  SurfaceMesh mesh =
      testing::grid_mesh(12, 12, 2.0, 2.0, [&](double, double) { return random.in(0.0, 0.2); });
  const std::int64_t count = mesh.triangle_count();
  mesh.triangles.conservativeResize(3, 3 * count);
  for (std::int64_t t = 0; t < count; ++t) {
    const Eigen::Vector3i tri = mesh.triangles.col(t);
    mesh.triangles.col(count + t) << tri[1], tri[0], tri[2];          // doubled, turned over
    mesh.triangles.col(2 * count + t) << tri[0], tri[1], tri[t % 2];  // no area
  }
  for (int k = 0; k < 20; ++k) {  // corners that differ but coincide or lie on a line
    const auto v = random.below(static_cast<int>(mesh.vertex_count()) - 2);
    mesh.vertices.col(v + 1) = 0.5 * (mesh.vertices.col(v) + mesh.vertices.col(v + 2));
  }
  expect_equal_to_brute_force(mesh, kRadius, 600, random);
}

TEST(DropCutter, EqualsBruteForceOnHugeBesideTinyTriangles) {
  Random random(7);
  const SurfaceMesh mesh = soup(400, [&](int t) {
    const double size = t % 40 == 0 ? 100.0 : t % 4 == 0 ? 1.0 : 0.01;
    const Eigen::Vector3d at = random.point(3.0, 0.3) - Eigen::Vector3d(0.4, 0.4, 0.0) * size;
    Eigen::Matrix3d m;
    m << at, at + Eigen::Vector3d(size, random.in(0, size), random.in(0, 0.01 * size)),
        at + Eigen::Vector3d(random.in(0, size), size, random.in(0, 0.01 * size));
    return m;
  });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d p(random.in(-1.0, 4.0), random.in(-1.0, 4.0));
    EXPECT_NEAR(cutter.drop(p).tip, brute_force(mesh, p, kRadius), 1e-12);
  }
  expect_equal_to_brute_force(mesh, kRadius, 200, random);
}

TEST(DropCutter, EqualsBruteForceOnAFoldedClosedBody) {
  // A torus standing on its rim: overhangs, vertical tangents and a hole.
  SurfaceMesh mesh = testing::grid_mesh(49, 33, 1.0, 1.0, [](double, double) { return 0.0; });
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
    const double u = 2.0 * std::numbers::pi * mesh.vertices(0, v);
    const double w = 2.0 * std::numbers::pi * mesh.vertices(1, v);
    const double ring = 1.0 + 0.4 * std::cos(w);
    mesh.vertices.col(v) << ring * std::cos(u), 0.4 * std::sin(w), ring * std::sin(u);
  }
  Random random(8);
  expect_equal_to_brute_force(mesh, kRadius, 400, random);
}

TEST(DropCutter, RestsInAVGrooveOnBothSides) {
  const double slope = 0.8;
  const SurfaceMesh mesh = testing::grid_mesh(
      21, 5, 2.0, 2.0, [&](double x, double) { return slope * std::abs(x - 1.0); });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const double secant = std::sqrt(1.0 + slope * slope);
  for (const double x : {1.0, 1.05, 0.8, 0.93}) {
    EXPECT_NEAR(cutter.drop({x, 0.77}).tip, slope * std::abs(x - 1.0) + kRadius * (secant - 1.0),
                1e-14);
  }
}

TEST(DropCutter, FollowsASphereToTheAccuracyOfItsMesh) {
  const double rho = 5.0;
  const SurfaceMesh mesh = testing::grid_mesh(201, 201, 2.0, 2.0, [&](double x, double y) {
    return std::sqrt(rho * rho - (x - 1) * (x - 1) - (y - 1) * (y - 1));
  });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const double sagitta = 0.01 * 0.01 * 2.0 / (8.0 * rho);  // diagonal of a cell as a chord
  for (double x = 0.3; x < 1.7; x += 0.0437) {
    const double sum = rho + kRadius;
    const double exact = std::sqrt(sum * sum - (x - 1) * (x - 1) - 0.04) - kRadius;
    const double tip = cutter.drop({x, 1.2}).tip;
    EXPECT_LE(tip, exact + 1e-12);
    EXPECT_GE(tip, exact - 1.1 * sagitta);
  }
}

TEST(DropCutter, NamesATriangleThatHoldsTheBall) {
  Random random(9);
  const SurfaceMesh mesh =
      testing::grid_mesh(12, 12, 2.0, 2.0, [&](double, double) { return random.in(0.0, 0.2); });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d p(random.in(0.0, 2.0), random.in(0.0, 2.0));
    const CutterLocation location = cutter.drop(p);
    Eigen::Matrix3d corners;
    corners << mesh.corner(location.triangle, 0), mesh.corner(location.triangle, 1),
        mesh.corner(location.triangle, 2);
    EXPECT_NEAR(triangle_tip(p, kRadius, corners), location.tip, 1e-12);
  }
}

TEST(DropCutter, FindsNothingBesideTheMeshAndOnAnEmptyOne) {
  const SurfaceMesh mesh = testing::grid_mesh(3, 3, 1.0, 1.0, [](double, double) { return 1.0; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  EXPECT_FALSE(cutter.drop({1.2001, 0.5}).rests());
  EXPECT_EQ(cutter.drop({1.2001, 0.5}).tip, kNoContact);
  EXPECT_TRUE(cutter.drop({1.1999, 0.5}).rests());
  EXPECT_FALSE(cutter.drop({1e9, -1e9}).rests());
  EXPECT_FALSE(DropCutter(SurfaceMesh{}, kRadius, Executor::serial()).drop({0.0, 0.0}).rests());
}

TEST(DropCutter, SameBitsForAnyThreadsAndAnyStart) {
  const SurfaceMesh mesh = testing::grid_mesh(81, 81, 10.0, 10.0, testing::lens_relief);
  const DropCutter one(mesh, kRadius, Executor::serial());
  const DropCutter two(mesh, kRadius, Executor::cpu(2));
  std::vector<Eigen::Vector2d> points;
  points.reserve(20000);
  for (int i = 0; i < 20000; ++i) {
    points.emplace_back(std::fmod(i * 0.7548776662466927, 1.0) * 10.0,
                        std::fmod(i * 0.5698402909980532, 1.0) * 10.0);
  }
  points[77] = mesh.vertices.col(333).head<2>();
  std::vector<CutterLocation> a(points.size());
  std::vector<CutterLocation> b(points.size());
  one.drop(points, a, Executor::serial());
  two.drop(points, b, Executor::cpu(2));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CutterLocation alone = one.drop(points[i]);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a[i].tip), std::bit_cast<std::uint64_t>(b[i].tip));
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a[i].tip), std::bit_cast<std::uint64_t>(alone.tip));
    ASSERT_EQ(a[i].triangle, b[i].triangle);
    ASSERT_EQ(a[i].triangle, alone.triangle);
  }
}

}  // namespace
}  // namespace lensforge::drop_cutter_test
