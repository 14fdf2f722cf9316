// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "design/reflect/light/reflection_energy.h"
#include "fixtures/shapes/shapes.h"

// The expected figures are closed forms of direct retroreflection (integrals of L(μ)² over the
// band) and, for the dihedral, of one integral over the lobe.
namespace lensforge::reflect {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

DirectionSet band() { return band_directions(20.0 * kDegree, {16, 64, 0.0}); }

Energies energies(const SurfaceMesh& mesh) {
  return evaluate(mesh, Goal{}, band(), Executor::cpu());
}

TEST(Evaluate, SphereHasTheMeanOfAllNormals) {
  const Energies e = energies(shapes::icosphere(5));
  EXPECT_NEAR(e.direct, 0.08748, 0.01 * 0.08748);
  EXPECT_NEAR(e.total, e.direct, 1e-9);
}

TEST(Evaluate, CubeAndOctahedronMatchTheirBandAverages) {
  EXPECT_NEAR(energies(shapes::cube(1)).direct, 0.17045, 0.01 * 0.17045);
  EXPECT_NEAR(energies(shapes::octahedron()).direct, 8.27e-5, 0.01 * 8.27e-5);
}

/// One face whose normal stands at this elevation.
SurfaceMesh tilted_face(double elevation) {
  const Eigen::Vector3d n(std::cos(elevation), 0.0, std::sin(elevation));
  const Eigen::Vector3d u = Eigen::Vector3d::UnitY();
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << Eigen::Vector3d::Zero(), u, n.cross(u);
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  return mesh;
}

TEST(Evaluate, BandAverageFollowsTheElevationOfTheNormal) {
  const std::pair<double, double> kKnown[] = {{0, 0.102269}, {10, 0.1020},  {15, 0.0937},
                                              {20, 0.0516},  {25, 9.03e-3}, {30, 3.690e-4},
                                              {45, 2.38e-5}, {90, 3.57e-6}};
  for (const auto& [elevation, mean] : kKnown) {
    const double e = energies(tilted_face(elevation * kDegree)).direct;
    EXPECT_NEAR(e / (0.5 * kEnergyScale), mean, 0.01 * mean) << elevation;
  }
}

TEST(Evaluate, ConvexShapesKeepTheirEnergyOverTheWholeSphereOfDirections) {
  const DirectionSet all = band_directions(0.5 * std::numbers::pi, {32, 64, 0.0});
  for (const SurfaceMesh& mesh :
       {shapes::cube(1), shapes::octahedron(), shapes::ellipsoid({1.3, 0.8, 0.5}, 4)}) {
    EXPECT_NEAR(evaluate(mesh, Goal{}, all, Executor::cpu()).direct, 0.08748, 0.01 * 0.08748);
  }
}

/// Radiance of a face at the edge of a dihedral, for light across it; the plates are some hundred
/// times as long and wide as the face is far from the edge.
FaceRadiance dihedral_radiance(double phi) {
  SurfaceMesh mesh = shapes::dihedral(4.0, 4, 21);
  for (const int axis : {0, 2}) {
    mesh.vertices.row(axis) = 2.0 * (0.5 * mesh.vertices.row(axis)).array().pow(4);
  }
  const Eigen::Vector3d w(std::sin(phi), 0.0, std::cos(phi));
  const LightPaths paths(mesh, Goal{}, listed_directions(w), 2048, Executor::cpu());
  const Faces& faces = paths.faces();
  Eigen::Index nearest = 0;
  (faces.centroid.colwise() - Eigen::Vector3d(0.004, 0.0, 0.0))
      .colwise()
      .squaredNorm()
      .minCoeff(&nearest);
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::serial());
  return energy.radiance(nearest, faces.normal);
}

TEST(Evaluate, RightAngledDihedralSendsLightBackByTwoReflections) {
  const FaceRadiance at_45 = dihedral_radiance(45.0 * kDegree);
  EXPECT_NEAR(at_45.direct[0], 0.009566, 1e-6);
  EXPECT_NEAR(at_45.indirect[0], 0.868132, 0.01 * 0.868132);
  const FaceRadiance at_20 = dihedral_radiance(20.0 * kDegree);
  EXPECT_NEAR(at_20.direct[0], 0.014015, 1e-6);
  EXPECT_NEAR(at_20.indirect[0], 0.5560, 0.01 * 0.5560);
}

TEST(Evaluate, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(60, 40);
  const Energies one = evaluate(mesh, Goal{}, band(), Executor::serial());
  const Energies two = evaluate(mesh, Goal{}, band(), Executor::cpu(2));
  EXPECT_EQ(one.direct, two.direct);
  EXPECT_EQ(one.total, two.total);
}

}  // namespace
}  // namespace lensforge::reflect
