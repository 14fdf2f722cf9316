// SPDX-License-Identifier: GPL-3.0-or-later
// Solids of lenses that have an outline.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/outline.h"
#include "core/temp_folder.h"
#include "export/files/closed_solid.h"
#include "export/part21.h"
#include "export/sample_surfaces.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"
#include "export/spline/spline_net.h"

namespace lensforge::testing::trimmed_solid_test {
namespace {

const Eigen::Vector2d kSize(30.0, 24.0);
const StepHeader kHeader{"lens", "", "", "lensforge 9", ""};

/// Not seen as a whole from its middle, and with a deep notch.
Outline letter() {
  return polygon_outline(kSize, {{0, 0}, {5, 0}, {5, 1}, {1.5, 1.2}, {1.5, 4}, {0, 4}});
}

/// A star of 2 · tips sides.
Outline star(int tips) {
  std::vector<Eigen::Vector2d> points;
  for (int k = 0; k < 2 * tips; ++k) {
    const double angle = std::numbers::pi * k / tips;
    points.emplace_back((k % 2 == 0 ? 1.0 : 0.9) *
                        Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return polygon_outline(kSize, points);
}

std::vector<Outline> outlines() {
  return {circle_outline(kSize), rounded_outline(kSize, 4.0), rounded_outline(kSize, 12.0),
          letter(), star(110)};
}

std::size_t wall_count(const Outline& outline) { return walls_of(outline).size(); }

const SplineNet& one_patch(const SurfaceMesh& mesh) {
  static std::map<Eigen::Index, SplineNet> nets;
  const auto [at, is_new] = nets.try_emplace(mesh.vertices.cols());
  if (is_new) {
    FitOptions options;
    options.one_patch = true;
    options.max_control_points = 4000;
    at->second = fit_spline_net(SmoothSurface(mesh), options, Executor::serial(), RunControl());
  }
  return at->second;
}

SplineNet cut(const SurfaceMesh& mesh, const Outline& outline,
              const std::optional<SphericalFront>& front = {}) {
  SplineNet net = one_patch(mesh);
  net.outline = outline;
  net.front = front;
  return net;
}

/// Of the facets' part inside of the outline, closed: nothing of the splines goes into it.
double facet_volume(const SurfaceMesh& mesh, const Outline& outline,
                    const std::optional<SphericalFront>& front = {}) {
  const MeshCut inside = cut_mesh(mesh, outline, Executor::serial());
  const SurfaceMesh part = part_inside(mesh, vertex_area_normals(mesh), inside).mesh;
  return enclosed_volume(closed_solid(part, "mesh", front));
}

/// By points drawn evenly over the rectangle. @return mean and its standard error, mm³.
std::pair<double, double> drawn_volume(const SplineNet& net, int points) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const OutlineIndex index(*net.outline);
  double sum = 0.0;
  double squares = 0.0;
  for (int k = 0; k < points; ++k) {
    const Eigen::Vector2d xy = kSize.cwiseProduct(Eigen::Vector2d(unit(random), unit(random)));
    const double z = index.contains(xy) ? net.at(*net.parameters_of(xy, xy)).surface.z : 0.0;
    sum += z;
    squares += z * z;
  }
  const double mean = sum / points;
  return {kSize.prod() * mean, kSize.prod() * std::sqrt((squares / points - mean * mean) / points)};
}

TEST(OutlineWalls, AreTheOutlineWithoutChords) {
  for (const Outline& outline : outlines()) {
    double length = 0.0;
    const std::vector<OutlineWall> walls = walls_of(outline);
    for (std::size_t k = 0; k < walls.size(); ++k) {
      EXPECT_LT((walls[k].to - walls[(k + 1) % walls.size()].from).norm(), 1e-12);
      EXPECT_LT((walls[k].at(walls[k].last()) - walls[k].to).norm(), 1e-12);
      length += walls[k].length();
    }
    double chords = 0.0;
    for (std::size_t k = 0; k < outline.points.size(); ++k) {
      chords += (outline.points[(k + 1) % outline.points.size()] - outline.points[k]).norm();
    }
    EXPECT_NEAR(length, chords, 1e-6 * length);
  }
  EXPECT_EQ(wall_count(circle_outline(kSize)), 4U);
  EXPECT_EQ(wall_count(rounded_outline(kSize, 4.0)), 8U);
  EXPECT_EQ(wall_count(rounded_outline(kSize, 12.0)), 6U);
}

/// Of a slanted plane the volume is the area times the height at the area's middle.
TEST(OutlineVolume, OfACircleUnderAPlaneIsExact) {
  const SurfaceMesh mesh =
      surface_of(kSize, {31, 29}, [](double x, double y) { return 5.0 + 0.02 * x - 0.01 * y; });
  const SplineNet net = cut(mesh, circle_outline(kSize));
  const double height = 5.0 + 0.02 * 15.0 - 0.01 * 12.0;
  const double volume = std::numbers::pi * 144.0 * height;
  EXPECT_NEAR(net.volume(), volume, 1e-7 * volume);
}

TEST(OutlineVolume, IsTheIntegral) {
  for (const Outline& outline : outlines()) {
    const SplineNet net = cut(smooth_lens(71), outline);
    const auto [volume, error] = drawn_volume(net, 200000);
    EXPECT_NEAR(net.volume(), volume, 4.0 * error);
    EXPECT_NEAR(net.volume(), facet_volume(smooth_lens(71), outline), 1e-4 * volume);
  }
}

class TrimmedSolidFile : public ::testing::Test {
 protected:
  TempFolder folder_;
};

/// One closed solid of the facets' volume, whose extent is that of the outline as far as
/// OpenCASCADE's box of a trimmed spline goes.
void expect_solid(const SolidContent& content, const SplineNet& net, double facets) {
  EXPECT_TRUE(content.valid);
  EXPECT_TRUE(content.closed);
  EXPECT_EQ(content.solids, 1);
  EXPECT_EQ(content.faces, static_cast<int>(wall_count(*net.outline)) + 2);
  EXPECT_NEAR(content.volume, net.volume(), 1e-6 * net.volume());
  EXPECT_NEAR(content.volume, facets, 1e-4 * facets);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : net.outline->points) box.extend(p);
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    EXPECT_NEAR(content.low[k], box.min()[axis], 2e-3);
    EXPECT_NEAR(content.high[k], box.max()[axis], 2e-3);
  }
}

TEST_F(TrimmedSolidFile, ReadsBackAsOneClosedSolidOfTheFacetsVolume) {
  for (const SurfaceMesh& mesh : {smooth_lens(71), crowded_lens()}) {
    for (const Outline& outline : outlines()) {
      const SplineNet net = cut(mesh, outline);
      const double facets = facet_volume(mesh, outline);
      expect_solid(write_step(net, kHeader, StepSchema::kAp242, folder_ / "lens.step"), net,
                   facets);
      expect_solid(write_iges(net, kHeader, folder_ / "lens.igs"), net, facets);
    }
  }
}

TEST_F(TrimmedSolidFile, HasItsSphericalFront) {
  for (const double radius : {40.0, -60.0}) {
    SphericalFront front = spherical_front(radius, kSize);
    front.apex += Eigen::Vector3d(1.0, -2.0, 0.0);
    for (const Outline& outline : {rounded_outline(kSize, 4.0), letter()}) {
      const SplineNet net = cut(smooth_lens(71), outline, front);
      const double facets = facet_volume(smooth_lens(121), outline, front);
      expect_solid(write_step(net, kHeader, StepSchema::kAp214, folder_ / "lens.step"), net,
                   facets);
      expect_solid(write_iges(net, kHeader, folder_ / "lens.igs"), net, facets);
    }
  }
}

/// Without OpenCASCADE: names, kinds of faces, and that every edge has a face on both sides.
TEST_F(TrimmedSolidFile, WallsAreCylindersAndPlanes) {
  (void)write_step(cut(smooth_lens(71), rounded_outline(kSize, 4.0)), kHeader, StepSchema::kAp214,
                   folder_ / "lens.step");
  const Part21File file = parse_part21(read_bytes(folder_ / "lens.step"));
  std::map<std::string, std::map<std::string, int>> kinds;
  for (const int face : file.all("ADVANCED_FACE")) {
    const auto parts = split_parameters(file.records.at(face).parameters);
    ++kinds[parts.at(0)][file.records.at(std::stoi(parts.at(2).substr(1))).keyword];
  }
  EXPECT_EQ(kinds["'optical surface'"]["B_SPLINE_SURFACE_WITH_KNOTS"], 1);
  EXPECT_EQ(kinds["'side wall'"]["CYLINDRICAL_SURFACE"], 4);
  EXPECT_EQ(kinds["'side wall'"]["PLANE"], 4);
  EXPECT_EQ(kinds["'back'"]["PLANE"], 1);
  for (const int cylinder : file.all("CYLINDRICAL_SURFACE")) {
    const auto parts = split_parameters(file.records.at(cylinder).parameters);
    EXPECT_NEAR(std::stod(parts.at(2)), 4.0, 1e-9);
  }
  std::map<std::string, int> uses;
  for (const int edge : file.all("ORIENTED_EDGE")) {
    ++uses[split_parameters(file.records.at(edge).parameters).at(3)];
  }
  for (const auto& [edge, count] : uses) EXPECT_EQ(count, 2) << edge;
}

}  // namespace
}  // namespace lensforge::testing::trimmed_solid_test
