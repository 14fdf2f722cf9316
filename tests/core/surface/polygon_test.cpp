// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "core/mesh/mesh_readers.h"

namespace lensforge {
namespace {

using Triangles = std::vector<Eigen::Vector3i>;

Eigen::Matrix3Xd flat(const std::vector<std::array<double, 2>>& points) {
  Eigen::Matrix3Xd corners(3, static_cast<Eigen::Index>(points.size()));
  Eigen::Index column = 0;
  for (const auto& point : points) corners.col(column++) << point[0], point[1], 0.0;
  return corners;
}

Eigen::Vector3d area_of(const Eigen::Matrix3Xd& corners, const Eigen::Vector3i& t) {
  const Eigen::Vector3d a = corners.col(t[0]);
  return 0.5 * (corners.col(t[1]) - a).cross(corners.col(t[2]) - a);
}

double polygon_area(const Eigen::Matrix3Xd& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    sum += corners.col(i).cross(corners.col((i + 1) % corners.cols()));
  }
  return 0.5 * sum.norm();
}

/// All triangles have an area and the same side, and cover the polygon: their areas add up to its.
void expect_cut(const Eigen::Matrix3Xd& corners) {
  const Triangles triangles = polygon_triangles(corners);
  ASSERT_EQ(std::ssize(triangles), corners.cols() - 2);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double absolute = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::Vector3d area = area_of(corners, t);
    sum += area;
    absolute += area.norm();
    least = std::min(least, area.norm());
  }
  EXPECT_GT(least, 0.0);
  EXPECT_NEAR(sum.norm(), polygon_area(corners), 1e-9 * absolute);
  EXPECT_NEAR(absolute, polygon_area(corners), 1e-9 * absolute);
}

TEST(Polygon, AConvexOneIsAFan) {
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {2, 0}, {2, 1}, {0, 1}})),
            (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {0, 1}, {2, 1}, {2, 0}})),
            (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Polygon, AConcaveQuadIsCutThroughItsHollowCorner) {
  const Eigen::Matrix3Xd arrow = flat({{0, 0}, {2, 1}, {0, 2}, {0.5, 1}});
  expect_cut(arrow);
  for (const Eigen::Vector3i& t : polygon_triangles(arrow)) {
    EXPECT_TRUE((t.array() == 1).any() && (t.array() == 3).any());
  }
}

TEST(Polygon, CornersInTheMiddleOfASideMakeNoTriangleWithoutArea) {
  expect_cut(flat({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}));
  expect_cut(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 3}}));
  expect_cut(flat({{1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}, {0, 0}}));
}

TEST(Polygon, APolygonThatIsCutOpenAroundAHoleIsCovered) {
  expect_cut(
      flat({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}));
}

TEST(Polygon, RandomStarsInAnyPlaneAreCovered) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 300; ++run) {
    const int count = 4 + static_cast<int>(random() % 40);
    Eigen::Matrix3Xd corners(3, count);
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.8 * unit(random)) / count;
      const double radius = 0.2 + unit(random);
      corners.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.0;
    }
    const Eigen::Quaterniond turned = Eigen::Quaterniond(unit(random) - 0.5, unit(random) - 0.5,
                                                         unit(random) - 0.5, unit(random) - 0.5);
    expect_cut(turned.normalized().toRotationMatrix() * corners);
  }
}

TEST(Polygon, ALineAndACrossedQuadAreCutSomehow) {
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}})).size(), 2U);
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {1, 1}, {1, 0}, {0, 1}})).size(), 2U);
  EXPECT_EQ(polygon_triangles(flat({{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}})).size(), 3U);
}

}  // namespace
}  // namespace lensforge
