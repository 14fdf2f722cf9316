// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "fixtures/shapes/shapes.h"

// Lengths are metres. The closed forms are for 3 GHz and sides of 1.5 m.
namespace lensforge::reflect {
namespace {

constexpr double kWavelength = 299792458.0 / 3e9;
constexpr double kSide = 1.5;

double section(const SurfaceMesh& mesh, const Eigen::Vector3d& towards,
               Polarization polarization = Polarization::kVertical) {
  const SurfaceMesh merged = repair_mesh(mesh, "mesh").mesh;
  return RadarBody(merged, kWavelength)
      .cross_section(towards.normalized(), polarization, Executor::cpu(2));
}

double dbsm(const SurfaceMesh& mesh, const Eigen::Vector3d& towards,
            Polarization polarization = Polarization::kVertical) {
  return 10.0 * std::log10(section(mesh, towards, polarization));
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
  // Its rim lies across the sight and adds up.
  EXPECT_NEAR(dbsm(mesh, {1, 1, 1}), expected, 0.5);
}

/// A disc of radius 1 in the plane z = 0, or a cone of that base with its tip at this height.
SurfaceMesh disc_or_cone(double height) {
  constexpr int kSides = 720;
  SurfaceMesh mesh;
  mesh.vertices.resize(3, kSides + 2);
  mesh.triangles.resize(3, height > 0.0 ? 2 * kSides : kSides);
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    mesh.vertices.col(i) << std::cos(angle), std::sin(angle), 0.0;
    mesh.triangles.col(i) << i, (i + 1) % kSides, kSides;
    if (height > 0.0) mesh.triangles.col(kSides + i) << (i + 1) % kSides, i, kSides + 1;
  }
  mesh.vertices.rightCols<2>() << 0.0, 0.0, 0.0, 0.0, height, 0.0;
  return mesh;
}

constexpr std::array kBoth{Polarization::kVertical, Polarization::kHorizontal};

/// What a polarization is for edges across the plane of sight and z.
double soft_sign(Polarization p) { return p == Polarization::kHorizontal ? 1.0 : -1.0; }

TEST(RadarCrossSection, PlateAtGrazingAnglesIsRosss) {
  // R. A. Ross, "Radar cross section of rectangular flat plates as a function of aspect angle",
  // IEEE Trans. Antennas Propag. 14(3), 329-335, 1966, the terms of single diffraction; angle from
  // the normal. Between minima, which the plate's other edges fill.
  const SurfaceMesh plate = plates(1);
  for (const Polarization p : kBoth) {
    for (const double degrees : {60.0, 68.0, 76.0, 84.0, 88.0}) {
      const double sine = std::sin(degrees * kDegree);
      const double x = 2.0 * std::numbers::pi / kWavelength * kSide * sine;
      const double ross = kSide * kSide / std::numbers::pi *
                          (std::pow(std::cos(x), 2) + std::pow(std::sin(x) / sine, 2));
      EXPECT_NEAR(dbsm(plate, {sine, 0.0, std::cos(degrees * kDegree)}, p), 10.0 * std::log10(ross),
                  0.6)
          << degrees;
    }
  }
}

TEST(RadarCrossSection, PlateSeenFromItsRimIsItsLeadingEdge) {
  // b²/π with the field along the edge (Ross 1966), which physical optics lacks altogether.
  EXPECT_NEAR(dbsm(plates(1), {1, 0, 0}, Polarization::kHorizontal),
              10.0 * std::log10(kSide * kSide / std::numbers::pi), 0.5);
}

TEST(RadarCrossSection, BothPolarizationsAreEqualAtTheSpecular) {
  for (const SurfaceMesh& mesh : {plates(1), disc_or_cone(0.0)}) {
    EXPECT_NEAR(dbsm(mesh, {0, 0, 1}, Polarization::kVertical),
                dbsm(mesh, {0, 0, 1}, Polarization::kHorizontal), 0.01);
  }
}

TEST(RadarCrossSection, DihedralOffItsAxisIsItsApertureOfTwoBounces) {
  // Tilted by ψ along the axis a ray moves on by 2 s tan ψ between its bounces, if it comes in s
  // beside the middle, and its phase goes with sin ψ: S = 2 cos ψ ∫ sin(k sin ψ (L − 2 s tan ψ)) ds
  // / (k sin ψ) over 0 … L/√2.
  for (const double psi : {0.02, 0.047, 0.08}) {
    const double q = 2.0 * std::numbers::pi / kWavelength * std::sin(psi);
    const double reach = kSide * (1.0 - std::numbers::sqrt2 * std::tan(psi));
    const double sum =
        std::cos(psi) * (std::cos(q * reach) - std::cos(q * kSide)) / (q * q * std::tan(psi));
    const double expected = 4.0 * std::numbers::pi * std::pow(sum / kWavelength, 2);
    const Eigen::Vector3d towards(std::cos(psi), std::numbers::sqrt2 * std::sin(psi),
                                  std::cos(psi));
    for (const Polarization p : kBoth) {
      EXPECT_NEAR(dbsm(plates(2), towards, p), 10.0 * std::log10(expected), 1.0) << psi;
    }
  }
}

TEST(RadarCrossSection, TiltedDihedralTurnsThePolarization) {
  // With its axis at 45° to the field it sends all of it back across.
  SurfaceMesh mesh = plates(2);
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d towards = Eigen::Vector3d(1, 0, 1).normalized();
  const Eigen::Vector3d field = radar_field(towards, Polarization::kHorizontal);
  ASSERT_NEAR(std::abs(field.dot(axis)), 1.0, 1e-12);
  const double straight = dbsm(mesh, towards);
  mesh.vertices =
      (Eigen::AngleAxisd(std::numbers::pi / 4.0, towards).matrix() * mesh.vertices).eval();
  EXPECT_LT(dbsm(mesh, towards), straight - 15.0);
}

TEST(RadarCrossSection, DiscIsKellersTwoPoints) {
  // J. B. Keller 1962: off the normal each end of the diameter in the plane of sight diffracts as a
  // half-plane, and the arc around it is integrated by stationary phase.
  const SurfaceMesh disc = disc_or_cone(0.0);
  const double k = 2.0 * std::numbers::pi / kWavelength;
  for (const Polarization p : kBoth) {
    for (const double degrees : {25.0, 40.0, 55.0, 70.0}) {
      const double sine = std::sin(degrees * kDegree);
      std::complex<double> sum = 0.0;
      for (const double side : {1.0, -1.0}) {
        const double half_plane = 0.5 * (soft_sign(p) + 1.0 / (side * sine));
        sum += half_plane * std::polar(1.0, side * (0.25 * std::numbers::pi - 2.0 * k * sine));
      }
      const double expected =
          k * k / std::numbers::pi * std::norm(sum / k) * std::numbers::pi / (k * sine);
      EXPECT_NEAR(dbsm(disc, {sine, 0.0, std::cos(degrees * kDegree)}, p),
                  10.0 * std::log10(expected), 1.0)
          << degrees << " " << (p == Polarization::kVertical);
    }
  }
}

TEST(RadarCrossSection, ConeSeenFromItsTipIsItsRim) {
  // J. B. Keller, "Backscattering from a finite cone", IRE Trans. Antennas Propag. 8(2), 175-182,
  // 1960: σ = πa² (2/n sin(π/n) / (cos(π/n) − cos(3π/n)))², n = 3/2 + half angle/π.
  for (const double half : {10.0, 15.0, 25.0}) {
    const double n = 1.5 + half / 180.0;
    const double c = std::cos(std::numbers::pi / n) - std::cos(3.0 * std::numbers::pi / n);
    const double expected =
        std::numbers::pi * std::pow(2.0 / n * std::sin(std::numbers::pi / n) / c, 2);
    const SurfaceMesh cone = disc_or_cone(1.0 / std::tan(half * kDegree));
    for (const Polarization p : kBoth) {
      EXPECT_NEAR(dbsm(cone, {0, 0, 1}, p), 10.0 * std::log10(expected), 0.3) << half;
    }
  }
}

TEST(RadarCrossSection, LargeSphereIsItsShadow) {
  const double expected = 10.0 * std::log10(std::numbers::pi);
  EXPECT_NEAR(dbsm(shapes::icosphere(6), {0.3, 0.5, 0.2}), expected, 0.2);
}

TEST(RadarCrossSection, RefusesShapesOfTooManyWavelengths) {
  EXPECT_THROW(require_radar_size(shapes::icosphere(1), 1e-4, "--radar"), InputError);
  EXPECT_NO_THROW(require_radar_size(shapes::icosphere(1), 0.1, "--radar"));
}

}  // namespace
}  // namespace lensforge::reflect
