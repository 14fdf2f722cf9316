// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

TEST(ParabolicShares, GoToOpticsForLargeRadii) {
  // The first terms of the asymptotic series of w, 1 − i/(2kρ) − 3/(4k²ρ²).
  constexpr double kRho = 60.0;
  const std::complex<double> w(1.0 - 0.75 / (kRho * kRho), -0.5 / kRho);
  const ParabolicShares shares = parabolic_shares(kRho);
  EXPECT_NEAR(std::abs(shares.along - 1.0 / w), 0.0, 3e-5);
  EXPECT_NEAR(std::abs(shares.across - 1.0 / (2.0 - w)), 0.0, 3e-5);
}

TEST(ParabolicShares, GoToTheEdgeOfAHalfPlaneForSmallRadii) {
  // Physical optics of the parabola is √(πρ/k) per length, an edge's field f/k.
  const RadarEdge edge{-Vector3d::UnitZ(),
                       Vector3d::UnitZ(),
                       {WedgeFace{Vector3d::UnitX(), Vector3d::UnitY()},
                        WedgeFace{Vector3d::UnitX(), -Vector3d::UnitY()}},
                       2.0,
                       {}};
  const double k_rho = 1e-6;
  const ParabolicShares shares = parabolic_shares(k_rho);
  const double along = edge_fringe(edge, -Vector3d::UnitX(), Vector3d::UnitZ());
  EXPECT_NEAR(std::abs(shares.along) * std::sqrt(pi * k_rho), std::abs(along), 3e-3);
  const double across = edge_fringe(edge, -Vector3d::UnitX(), Vector3d::UnitY());
  EXPECT_NEAR(std::abs(shares.across) * std::sqrt(pi * k_rho), std::abs(across), 3e-3);
}

TEST(CurvedFaces, OfATorusAreThoseOfItsTube) {
  const SurfaceMesh torus = shapes::torus(160, 80);
  constexpr double kWavelength = 0.8;
  const std::vector<CurvedFace> faces = curved_faces(
      torus, std::vector<bool>(static_cast<std::size_t>(torus.vertex_count())), kWavelength);
  const Faces measured = measure_faces(torus);
  const ParabolicShares tube = parabolic_shares(2.0 * pi / kWavelength * 0.4);
  const ParabolicShares ring = parabolic_shares(2.0 * pi / kWavelength * 1.4);
  for (Eigen::Index f = 0; f < measured.count(); ++f) {
    const Vector3d n = measured.normal.col(f);
    if (n.head<2>().norm() < 0.999 || measured.centroid.col(f).dot(n) < 0.0) continue;
    const CurvedFace& face = faces[static_cast<std::size_t>(f)];
    EXPECT_NEAR(std::abs(face.of(Vector3d::UnitZ(), n) / (tube.across * ring.along)), 1.0, 0.01);
    EXPECT_NEAR(std::abs(face.of(Vector3d::UnitZ().cross(n), n) / (tube.along * ring.across)), 1.0,
                0.01);
  }
}

TEST(CurvedFaces, AreFlatOnAPlateAndBesideCreases) {
  const SurfaceMesh plate = shapes::trihedral(3);
  const std::vector<bool> smooth(static_cast<std::size_t>(plate.vertex_count()));
  const SurfaceMesh ball = shapes::icosphere(2);
  const std::vector<bool> creased(static_cast<std::size_t>(ball.vertex_count()), true);
  for (const auto& faces : {curved_faces(plate, smooth, 1.0), curved_faces(ball, creased, 1.0)}) {
    for (const CurvedFace& face : faces) {
      EXPECT_EQ(face.of(Vector3d(0.6, 0.64, 0.48), Vector3d::UnitX()), 1.0);
    }
  }
}

}  // namespace
}  // namespace lensforge::reflect
