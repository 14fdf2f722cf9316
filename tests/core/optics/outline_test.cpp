// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/outline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/lens/lens.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/sample_splines.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;

const Eigen::Vector2d kSize(24.0, 20.0);

double random(std::mt19937_64& engine, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine);
}

/// A star with deep notches, whose corners lie anywhere between two circles.
Outline star(std::uint64_t seed, int corners) {
  std::mt19937_64 engine(seed);
  std::vector<Eigen::Vector2d> points;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / corners;
    const double radius = random(engine, 1.0, 5.0);
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return polygon_outline(kSize, points);
}

using Long = Eigen::Matrix<long double, 2, 1>;

long double turn(const Long& a, const Long& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Of two triangles, both counter-clockwise: the area that they share, in long double.
long double shared(const std::vector<Long>& one, const std::vector<Long>& other) {
  std::vector<Long> part = one;
  for (std::size_t k = 0; k < 3; ++k) {
    const Long& a = other[k];
    const Long side = other[(k + 1) % 3] - a;
    std::vector<Long> kept;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Long& p = part[i];
      const Long& q = part[(i + 1) % part.size()];
      const long double at_p = turn(side, p - a);
      const long double at_q = turn(side, q - a);
      if (at_p >= 0.0L) kept.push_back(p);
      if (at_p * at_q < 0.0L) kept.emplace_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
    part = kept;
  }
  long double doubled = 0.0L;
  for (std::size_t i = 0; i < part.size(); ++i) {
    doubled += turn(part[i], part[(i + 1) % part.size()]);
  }
  return 0.5L * doubled;
}

/// By the triangles from a far point to every side of the outline, each with its sign.
double shared_area(const Outline& outline, const PlanTriangle& t) {
  const Long from(-100.0L, -77.0L);
  std::vector<Long> triangle;
  for (const Eigen::Vector2d& p : t) triangle.emplace_back(p.cast<long double>());
  long double area = 0.0L;
  for (std::size_t k = 0; k < outline.points.size(); ++k) {
    const Long a = outline.points[k].cast<long double>();
    const Long b = outline.points[(k + 1) % outline.points.size()].cast<long double>();
    const bool left = turn(a - from, b - from) > 0.0L;
    const std::vector<Long> fan =
        left ? std::vector<Long>{from, a, b} : std::vector<Long>{from, b, a};
    area += (left ? 1.0L : -1.0L) * shared(fan, triangle);
  }
  return static_cast<double>(area);
}

PlanTriangle random_triangle(std::mt19937_64& engine) {
  for (;;) {
    PlanTriangle t;
    const Eigen::Vector2d at(random(engine, 0.0, kSize.x()), random(engine, 0.0, kSize.y()));
    const double size = std::exp(random(engine, std::log(0.05), std::log(10.0)));
    for (Eigen::Vector2d& p : t) {
      p = at + size * Eigen::Vector2d(random(engine, -1.0, 1.0), random(engine, -1.0, 1.0));
    }
    if (cross(t[1] - t[0], t[2] - t[0]) > 0.01 * size * size) return t;
  }
}

std::vector<Outline> outlines() {
  return {circle_outline(kSize), rounded_outline(kSize, 3.0), rounded_outline(kSize, 10.0),
          star(1, 9), star(2, 40)};
}

SurfaceMesh bumpy_mesh() {
  SurfaceMesh mesh = make_grid_mesh(kSize, {31, 29}, 5.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const double x = mesh.vertices(0, v);
    const double y = mesh.vertices(1, v);
    mesh.vertices(2, v) += 0.3 * std::sin(0.4 * x) * std::cos(0.3 * y);
  }
  return mesh;
}

double plan_area_of(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) area += mesh.plan_area(t);
  return area;
}

TEST(OutlineTest, CircleIsRoundToItsErrorBound) {
  const Outline circle = circle_outline({100.0, 120.0});
  EXPECT_EQ(circle.radius, 50.0);
  for (std::size_t k = 0; k < circle.points.size(); ++k) {
    const Eigen::Vector2d& a = circle.points[k];
    const Eigen::Vector2d& b = circle.points[(k + 1) % circle.points.size()];
    EXPECT_NEAR((a - Eigen::Vector2d(50.0, 60.0)).norm(), 50.0, 1e-12);
    const double middle = (0.5 * (a + b) - Eigen::Vector2d(50.0, 60.0)).norm();
    EXPECT_GT(middle, 50.0 * (1.0 - 2.4e-6));
  }
  const double area = std::numbers::pi * 2500.0;
  EXPECT_LT(polygon_area(circle.points), area);
  EXPECT_GT(polygon_area(circle.points), area * (1.0 - 3.2e-6));
}

TEST(OutlineTest, RoundedRectangleHasItsArea) {
  const Outline rounded = rounded_outline(kSize, 3.0);
  const double area = kSize.prod() - (4.0 - std::numbers::pi) * 9.0;
  EXPECT_NEAR(polygon_area(rounded.points), area, 1e-6 * area);
  EXPECT_FALSE(polygon_fault(rounded.points));
  EXPECT_FALSE(polygon_fault(rounded_outline(kSize, 10.0).points));
}

TEST(OutlineTest, PolygonIsAsLargeAsTheRectangleAllows) {
  const Outline turned = polygon_outline(kSize, {{0.0, 0.0}, {0.0, 2.0}, {1.0, 2.0}, {1.0, 0.0}});
  EXPECT_NEAR(polygon_area(turned.points), 20.0 * 10.0, 1e-9);
  for (const Eigen::Vector2d& p : turned.points) {
    EXPECT_NEAR(std::abs(p.x() - 12.0), 5.0, 1e-12);
    EXPECT_NEAR(std::abs(p.y() - 10.0), 10.0, 1e-12);
  }
}

TEST(OutlineTest, RefusesLinesThatCross) {
  EXPECT_THAT(polygon_fault({{0, 0}, {4, 4}, {4, 0}, {0, 4}}).value_or(""), HasSubstr("crosses"));
  EXPECT_THAT(polygon_fault({{0, 0}, {4, 0}, {2, 0}, {2, 3}}).value_or(""), HasSubstr("crosses"));
  EXPECT_THAT(polygon_fault({{0, 0}, {4, 0}}).value_or(""), HasSubstr("2 corners"));
  EXPECT_THAT(polygon_fault({{0, 0}, {4, 0}, {4, 0}, {0, 4}}).value_or(""), HasSubstr("twice"));
  EXPECT_FALSE(polygon_fault({{0, 0}, {4, 0}, {4, 4}, {2, 1}}));
}

TEST(OutlineIndexTest, SharesAreThoseOfSignedTriangles) {
  std::mt19937_64 engine(7);
  for (const Outline& outline : outlines()) {
    const OutlineIndex index(outline);
    for (int k = 0; k < 300; ++k) {
      const PlanTriangle t = random_triangle(engine);
      const double area = 0.5 * cross(t[1] - t[0], t[2] - t[0]);
      double share = 0.0;
      for (const TrianglePiece& piece : index.inside(t)) {
        EXPECT_GT(piece.share, 0.0);
        EXPECT_NEAR(piece.weights.colwise().sum().minCoeff(), 1.0, 1e-12);
        share += piece.share;
        const Eigen::Vector3d middle = piece.weights.rowwise().mean();
        EXPECT_TRUE(index.contains(middle[0] * t[0] + middle[1] * t[1] + middle[2] * t[2]) ||
                    piece.share < 1e-9);
      }
      EXPECT_NEAR(share * area, shared_area(outline, t), 1e-9 * area);
    }
  }
}

/// Edges of a mesh that have a triangle on one side only; how many closed lines they make, 0 if
/// they do not.
int rim_lines(const SurfaceMesh& mesh) {
  const MeshTopology topology = make_topology(mesh);
  std::map<int, int> next;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if (topology.neighbours(k, t) >= 0) continue;
      if (!next.emplace(mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t)).second) return 0;
    }
  }
  int lines = 0;
  while (!next.empty()) {
    for (int v = next.begin()->first; next.contains(v);) {
      const int follower = next.at(v);
      next.erase(v);
      v = follower;
    }
    ++lines;
  }
  return lines;
}

TEST(MeshCutTest, PartHasOneClosedRim) {
  for (const Outline& outline : outlines()) {
    for (const SurfaceMesh& mesh : {bumpy_mesh(), make_grid_mesh(kSize, {61, 50}, 5.0)}) {
      const SampledSurface part =
          part_inside(mesh, vertex_area_normals(mesh), cut_mesh(mesh, outline, Executor::serial()));
      EXPECT_EQ(rim_lines(part.mesh), 1) << outline.points.size();
    }
  }
}

TEST(MeshCutTest, PartsHaveTheOutlinesArea) {
  const SurfaceMesh mesh = bumpy_mesh();
  for (const Outline& outline : outlines()) {
    const MeshCut cut = cut_mesh(mesh, outline, Executor::serial());
    double area = 0.0;
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      area += cut.share[static_cast<std::size_t>(t)] * mesh.plan_area(t);
    }
    EXPECT_NEAR(area, polygon_area(outline.points), 1e-9 * kSize.prod());
    const SampledSurface part = part_inside(mesh, vertex_area_normals(mesh), cut);
    EXPECT_NEAR(plan_area_of(part.mesh), polygon_area(outline.points), 1e-9 * kSize.prod());
    EXPECT_NO_THROW(make_topology(part.mesh));
  }
}

TEST(MeshCutTest, PartKeepsThePlanesOfTheFacets) {
  const SurfaceMesh mesh = bumpy_mesh();
  const Outline outline = star(2, 40);
  const MeshCut cut = cut_mesh(mesh, outline, Executor::serial());
  for (const MeshCut::Piece& piece : cut.pieces) {
    if (piece.face < 0) continue;
    const Eigen::Vector3d n = area_normal(mesh, piece.face).normalized();
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      for (int j = 0; j < 3; ++j) p += piece.piece.weights(j, k) * mesh.corner(piece.face, j);
      EXPECT_NEAR(n.dot(p - mesh.corner(piece.face, 0)), 0.0, 1e-12);
    }
  }
}

TEST(MeshCutTest, IsTheSameForAnyNumberOfThreads) {
  const SurfaceMesh mesh = bumpy_mesh();
  const Outline outline = star(2, 40);
  const MeshCut one = cut_mesh(mesh, outline, Executor::serial());
  const MeshCut many = cut_mesh(mesh, outline, Executor::cpu(3));
  EXPECT_EQ(one.first, many.first);
  EXPECT_EQ(one.share, many.share);
  ASSERT_EQ(one.pieces.size(), many.pieces.size());
}

Lens outlined_lens() {
  Lens lens;
  lens.setup.lens_size = kSize;
  lens.setup.image_size = kSize;
  lens.setup.pixels = {12, 10};
  lens.target = Image(12, 10, 1.0F);
  lens.render = lens.target;
  lens.model = SurfaceModel::kSmooth;
  lens.surface = bumpy_mesh();
  return lens;
}

TEST(OutlinedLens, ComesBackAsItWasWritten) {
  for (const Outline& outline : outlines()) {
    const TempFolder folder;
    Lens lens = outlined_lens();
    lens.setup.outline = outline;
    write_lens(lens, folder.path());
    const Lens read = read_lens(folder.path());
    EXPECT_EQ(read.setup, lens.setup);
    EXPECT_EQ(read.surface.vertices, lens.surface.vertices);
    EXPECT_EQ(read.surface.grid, lens.surface.grid);
    const SurfaceMesh part = read_mesh(folder.path() / "surface.ply");
    EXPECT_NEAR(plan_area_of(part), polygon_area(outline.points), 1e-9 * kSize.prod());
  }
}

TEST(OutlinedLens, ComesBackWithItsSpline) {
  const TempFolder folder;
  Lens lens = outlined_lens();
  lens.setup.lens_size = {15.0, 10.0};
  lens.setup.outline = circle_outline(lens.setup.lens_size);
  lens.spline = testing::sample_spline();
  lens.model = SurfaceModel::kSpline;
  lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
  lens.metrics[SurfaceModel::kSpline] = {};
  write_lens(lens, folder.path());
  const Lens read = read_lens(folder.path());
  EXPECT_EQ(read.setup, lens.setup);
  EXPECT_EQ(read.spline->points, lens.spline->points);
  EXPECT_EQ(read.surface.vertices, lens.surface.vertices);
}

TEST(OutlinedLens, RefusesAPartOfAnotherSheet) {
  const TempFolder folder;
  Lens lens = outlined_lens();
  lens.setup.outline = circle_outline(kSize);
  write_lens(lens, folder.path());
  lens.surface.vertices(2, 400) += 0.01;
  write_ply(lens.surface, folder.path() / "sheet.ply");
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("hold two surfaces"));
}

}  // namespace
}  // namespace lensforge
