// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "fixtures/shapes/shapes.h"

// Lengths are metres. The closed forms are for 3 GHz and sides of 1.5 m.
namespace lensforge::reflect {
namespace {

constexpr double kWavelength = 299792458.0 / 3e9;
constexpr double kSide = 1.5;

double dbsm(const SurfaceMesh& mesh, const Eigen::Vector3d& towards) {
  return 10.0 *
         std::log10(radar_cross_section(mesh, towards.normalized(), kWavelength, Executor::cpu(2)));
}

SurfaceMesh plates(int count) {
  SurfaceMesh mesh = shapes::trihedral(1);
  mesh.vertices *= kSide;
  mesh.triangles.conservativeResize(3, 2 * count);
  return mesh;
}

TEST(RadarCrossSection, PlateIsFourPiAreaSquaredOverWavelengthSquared) {
  const double expected =
      10.0 * std::log10(4.0 * std::numbers::pi * std::pow(kSide, 4) / std::pow(kWavelength, 2));
  EXPECT_NEAR(expected, 38.0, 0.1);
  EXPECT_NEAR(dbsm(plates(1), {0, 0, 1}), expected, 0.2);
}

TEST(RadarCrossSection, DihedralReturnsByTwoBounces) {
  const double expected =
      10.0 * std::log10(8.0 * std::numbers::pi * std::pow(kSide, 4) / std::pow(kWavelength, 2));
  EXPECT_NEAR(expected, 41.0, 0.1);
  EXPECT_NEAR(dbsm(plates(2), {1, 0, 1}), expected, 0.2);
}

TEST(RadarCrossSection, TriangularTrihedralReturnsByThreeBounces) {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, 4);
  mesh.vertices.rightCols(3) = kSide * Eigen::Matrix3d::Identity();
  mesh.triangles.resize(3, 3);
  mesh.triangles << 0, 0, 0, 1, 2, 3, 2, 3, 1;
  const double expected = 10.0 * std::log10(4.0 * std::numbers::pi * std::pow(kSide, 4) / 3.0 /
                                            std::pow(kWavelength, 2));
  EXPECT_NEAR(expected, 33.3, 0.1);
  EXPECT_NEAR(dbsm(mesh, {1, 1, 1}), expected, 0.2);
}

TEST(RadarCrossSection, LargeSphereIsItsShadow) {
  const double expected = 10.0 * std::log10(std::numbers::pi);
  EXPECT_NEAR(dbsm(shapes::icosphere(6), {0.3, 0.5, 0.2}), expected, 0.2);
}

TEST(RadarCrossSection, RefusesShapesOfTooManyWavelengths) {
  EXPECT_THROW(
      radar_cross_section(shapes::icosphere(1), Eigen::Vector3d::UnitX(), 1e-4, Executor::serial()),
      InputError);
}

}  // namespace
}  // namespace lensforge::reflect
