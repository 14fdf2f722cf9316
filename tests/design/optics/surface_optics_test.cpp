// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "design/render/render_flux.h"
#include "design/snell.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::height_field;
using testing::setup_of;

const Eigen::Vector2d kSize(20.0, 16.0);
const GridShape kShape{25, 23};
constexpr SurfaceModel kModels[] = {SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// Millimetres on the receiving plane of a corner of an image triangle.
Eigen::Vector2d landing_mm(const OpticalSetup& setup, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d per_pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>());
  return setup.image_origin + setup.image_size - pixel.cwiseProduct(per_pixel);
}

/// Calls check(vertex, landing point in mm) for every corner of every image triangle.
template <class Check>
void for_each_landing(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Check& check) {
  const auto triangles = project_surface(mesh, setup, model, Executor::cpu(2));
  ASSERT_EQ(static_cast<std::int64_t>(triangles.size()), mesh.triangle_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const ImageTriangle& image = triangles[static_cast<std::size_t>(t)];
    check(mesh.triangles(0, t), landing_mm(setup, image.p0));
    check(mesh.triangles(1, t), landing_mm(setup, image.p1));
    check(mesh.triangles(2, t), landing_mm(setup, image.p2));
  }
}

double total_flux(const std::vector<ImageTriangle>& triangles) {
  return std::accumulate(triangles.begin(), triangles.end(), 0.0,
                         [](double sum, const ImageTriangle& t) { return sum + t.flux; });
}

TEST(SurfaceOptics, APlaneSendsLightStraightOn) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  for (const SurfaceModel model : kModels) {
    for_each_landing(mesh, setup, model, [&](int v, const Eigen::Vector2d& landing) {
      ASSERT_LT((landing - mesh.vertices.col(v).head<2>()).norm(), 1e-13);
    });
  }
}

TEST(SurfaceOptics, APrismShiftsByTheAngleOfDeflection) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const double tilt = 0.2;
  const double direction = 0.7;
  const Eigen::Vector2d uphill(std::cos(direction), std::sin(direction));
  const SurfaceMesh mesh = height_field(kSize, kShape, [&](double x, double y) {
    return 6.0 + std::tan(tilt) * uphill.dot(Eigen::Vector2d(x, y));
  });
  const double slope = std::tan(testing::refracted_angle(tilt, setup.ior) - tilt);
  for (const SurfaceModel model : kModels) {
    for_each_landing(mesh, setup, model, [&](int v, const Eigen::Vector2d& landing) {
      const Eigen::Vector3d p = mesh.vertices.col(v);
      const Eigen::Vector2d expected = p.head<2>() + (150.0 - p.z()) * slope * uphill;
      ASSERT_LT((landing - expected).norm(), 1e-12);
    });
  }
}

TEST(SurfaceOptics, AParaboloidFollowsTheExactRayLawAtInnerVertices) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const double radius = 60.0;
  const Eigen::Vector2d centre = 0.5 * kSize;
  const SurfaceMesh mesh = height_field(kSize, kShape, [&](double x, double y) {
    return 8.0 - (Eigen::Vector2d(x, y) - centre).squaredNorm() / (2.0 * radius);
  });
  // Rings of the grid are symmetric about their vertex away from the left and right border; there
  // the area-weighted normal of a paraboloid is exact.
  int checked = 0;
  const auto check = [&](int v, const Eigen::Vector2d& landing) {
    const int column = v % kShape.columns;
    const int row = v / kShape.columns;
    if (std::min(column, kShape.columns - 1 - column) <= kShiftFade) return;
    if (row == 0 || row == kShape.rows - 1) return;
    const Eigen::Vector3d p = mesh.vertices.col(v);
    const Eigen::Vector2d from_axis = p.head<2>() - centre;
    const double tilt = std::atan(from_axis.norm() / radius);
    const double deflection = testing::refracted_angle(tilt, setup.ior) - tilt;
    const Eigen::Vector2d inwards = -from_axis.stableNormalized();
    const Eigen::Vector2d expected = p.head<2>() + (150.0 - p.z()) * std::tan(deflection) * inwards;
    ASSERT_LT((landing - expected).norm(), 1e-11);
    ++checked;
  };
  for_each_landing(mesh, setup, SurfaceModel::kSmooth, check);
  EXPECT_GT(checked, 1000);
}

TEST(SurfaceOptics, TransmittedFluxAddsUpToOne) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const SurfaceMesh mesh = height_field(kSize, kShape, testing::bumps);
  for (const SurfaceModel model : kModels) {
    EXPECT_NEAR(total_flux(project_surface(mesh, setup, model, Executor::serial())), 1.0, 1e-13);
  }
}

TEST(SurfaceOptics, SteepPlacesAreDark) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const int spike = 11 * kShape.columns + 12;
  mesh.vertices(2, spike) += 3.0;
  const double dark = 6.0 / static_cast<double>(mesh.triangle_count());
  // The smooth model has an even normal on the spike itself and steep ones around it.
  EXPECT_NEAR(total_flux(project_surface(mesh, setup, SurfaceModel::kFacet, Executor::serial())),
              1.0 - dark, 1e-12);
  EXPECT_LT(total_flux(project_surface(mesh, setup, SurfaceModel::kSmooth, Executor::serial())),
            1.0 - dark);
}

TEST(SurfaceOptics, ThreadCountDoesNotChangeABit) {
  const OpticalSetup setup = setup_of(kSize, {40, 32}, 150.0);
  const SurfaceMesh mesh = height_field(kSize, {90, 80}, testing::bumps);
  for (const SurfaceModel model : kModels) {
    const auto serial = project_surface(mesh, setup, model, Executor::serial());
    const auto parallel = project_surface(mesh, setup, model, Executor::cpu(2));
    for (std::size_t i = 0; i < serial.size(); ++i) {
      ASSERT_TRUE(serial[i].p0 == parallel[i].p0 && serial[i].p1 == parallel[i].p1 &&
                  serial[i].p2 == parallel[i].p2 && serial[i].flux == parallel[i].flux);
    }
  }
}

}  // namespace
}  // namespace lensforge
