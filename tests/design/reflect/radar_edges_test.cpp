// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/compute/scalar.h"
#include "design/reflect/radar.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

/// A wedge with its edge on z and its first face in y = 0, x > 0.
RadarEdge wedge(double open) {
  const double angle = open * pi;
  const Vector3d out(std::cos(angle), std::sin(angle), 0.0);
  return {-Vector3d::UnitZ(),
          Vector3d::UnitZ(),
          {WedgeFace{Vector3d::UnitX(), Vector3d::UnitY()},
           WedgeFace{out, {std::sin(angle), -std::cos(angle), 0.0}}},
          open,
          {}};
}

Vector3d direction(double phi, double elevation = 0.0) {
  return {std::cos(elevation) * std::cos(phi), std::cos(elevation) * std::sin(phi),
          std::sin(elevation)};
}

/// The end of a lit face in physical optics, as edge_fringe() counts it.
double optics_of_faces(double open, double phi) {
  double sum = 0.0;
  for (const double above : {phi, open * pi - phi}) {
    if (above < pi) sum -= 0.5 * std::tan(above);
  }
  return sum;
}

/// Keller's coefficients of backscatter ("Geometrical theory of diffraction", J. Opt. Soc. Am. 52,
/// 1962), without their common factor. @param sign  −1: the electric field along the edge, 1:
/// across.
double keller(double open, double phi, double sign) {
  const double c = std::cos(pi / open);
  return -std::sin(pi / open) / open * (1.0 / (c - 1.0) + sign / (c - std::cos(2.0 * phi / open)));
}

TEST(EdgeFringe, WithPhysicalOpticsIsKellersDiffractionByAWedge) {
  for (const double open : {2.0, 1.9, 1.75, 1.5, 1.2}) {
    for (double phi = 0.05; phi < open * pi; phi += 0.171) {
      const RadarEdge edge = wedge(open);
      const double optics = optics_of_faces(open, phi);
      const Vector3d across(-std::sin(phi), std::cos(phi), 0.0);
      EXPECT_NEAR(edge_fringe(edge, direction(phi), Vector3d::UnitZ()) + optics,
                  keller(open, phi, -1.0), 1e-9 * (1.0 + std::abs(optics)))
          << open << " " << phi;
      // A magnetic field that comes back as it was has an electric one of the other sign.
      EXPECT_NEAR(edge_fringe(edge, direction(phi), across) + optics, -keller(open, phi, 1.0),
                  1e-9 * (1.0 + std::abs(optics)))
          << open << " " << phi;
    }
  }
}

TEST(EdgeFringe, IsSommerfeldsForAHalfPlane) {
  for (double phi = 0.1; phi < 2.0 * pi; phi += 0.3) {
    const double optics = optics_of_faces(2.0, phi);
    EXPECT_NEAR(edge_fringe(wedge(2.0), direction(phi), Vector3d::UnitZ()) + optics,
                0.5 * (1.0 - 1.0 / std::cos(phi)), 1e-9 * (1.0 + std::abs(optics)));
  }
}

TEST(EdgeFringe, IsContinuousWherePhysicalOpticsIsSingular) {
  constexpr double kStep = 2e-4;
  for (const double open : {2.0, 1.5, 1.25}) {
    for (const double elevation : {0.0, 0.3, 0.6, 0.78}) {
      // Sight perpendicular to the grazing ray.
      const double pole = std::acos(std::pow(std::tan(elevation), 2));
      for (const Vector3d& seed : {Vector3d(0.3, 0.2, 1.0), Vector3d(1.0, -2.0, 0.1)}) {
        const auto at = [&](double phi) {
          const Vector3d towards = direction(phi, elevation);
          return edge_fringe(wedge(open), towards, towards.cross(seed).normalized());
        };
        EXPECT_NEAR(at(pole), 0.5 * (at(pole - kStep) + at(pole + kStep)), 1e-4)
            << open << " " << elevation;
      }
    }
  }
}

TEST(EdgeFringe, IsFiniteInEveryDirection) {
  for (const double open : {2.0, 1.6, 1.1}) {
    for (const double elevation : {-1.5707, -0.8, 0.0, 1e-9, 0.5, pi / 4.0, 1.5}) {
      for (int i = 0; i <= 48; ++i) {
        const Vector3d towards = direction(i * pi / 24.0, elevation);
        const double value = edge_fringe(wedge(open), towards, towards.unitOrthogonal());
        EXPECT_LT(std::abs(value), 20.0) << open << " " << elevation << " " << i;
      }
    }
  }
}

TEST(EdgeFringe, DoesNotDependOnTheOrderOfFacesAndTheSignOfTheField) {
  const RadarEdge edge = wedge(1.6);
  const RadarEdge turned{edge.to, edge.from, {edge.faces[1], edge.faces[0]}, edge.open, {}};
  const Vector3d towards = direction(1.1, 0.4);
  const Vector3d field = towards.cross(Vector3d(0.2, 0.9, -0.3)).normalized();
  EXPECT_DOUBLE_EQ(edge_fringe(edge, towards, field), edge_fringe(turned, towards, -field));
}

TEST(RadarEdges, AreThoseThatTheWaveSees) {
  constexpr double kWavelength = 0.1;
  EXPECT_THAT(radar_edges(shapes::icosphere(6), kWavelength), ::testing::IsEmpty());
  EXPECT_EQ(radar_edges(shapes::icosphere(0), kWavelength).size(), 30U);
  EXPECT_EQ(radar_edges(shapes::octahedron(), kWavelength).size(), 12U);
  const std::vector<RadarEdge> rim = radar_edges(shapes::concave_facade(0.3, 20), kWavelength);
  EXPECT_EQ(std::count_if(rim.begin(), rim.end(), [](const RadarEdge& e) { return e.open == 2.0; }),
            80);
}

TEST(RadarEdges, AreOutsideOfTheMaterial) {
  for (const RadarEdge& edge : radar_edges(shapes::octahedron(), 0.1)) {
    EXPECT_NEAR(edge.open, 2.0 - std::acos(-1.0 / 3.0) / pi, 1e-12);
    for (const WedgeFace& face : edge.faces) {
      EXPECT_GT(face.normal.dot(edge.from), 0.0);
      EXPECT_NEAR(face.out.dot(edge.to - edge.from), 0.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace lensforge::reflect
