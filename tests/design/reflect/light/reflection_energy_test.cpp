// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/reflection_energy.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/compute/scalar.h"
#include "design/finite_difference.h"
#include "design/reflect/input.h"
#include "fixtures/shapes/shapes.h"

// The expected figures are closed forms of direct retroreflection (integrals of L(μ)² over the
// band) and, for the dihedral, of one integral over the lobe.

namespace lensforge::reflect {
namespace {

/// Largest error of the gradient along random directions, relative to the largest slope.
double slope_error(const ReflectionEnergy& energy, const Eigen::Matrix3Xd& normals) {
  Eigen::Matrix3Xd gradient;
  EXPECT_NEAR(energy.value_and_gradient(normals, gradient), energy.value(normals),
              1e-12 * std::abs(energy.value(normals)));
  const auto value = [&](const Eigen::VectorXd& x) {
    return energy.value(Eigen::Map<const Eigen::Matrix3Xd>(x.data(), 3, normals.cols()));
  };
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  double error = 0.0;
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::VectorXd direction =
        Eigen::VectorXd::NullaryExpr(normals.size(), [&] { return normal(random); }).normalized();
    const double expected = testing::directional_slope(value, normals.reshaped(), direction, 1e-3);
    const double computed = gradient.reshaped().dot(direction);
    error = std::max(error, std::abs(computed - expected) / std::abs(expected));
  }
  return error;
}

double slope_error(const SurfaceMesh& mesh, const Goal& goal, Loss loss) {
  const DirectionSet directions =
      goal.has_place() ? sun_directions(6) : band_directions(0.35, {3, 12, 0.1});
  const LightPaths paths(mesh, goal, directions, 32, Executor::cpu(2));
  return slope_error(ReflectionEnergy(paths, loss, Executor::cpu(2)), paths.faces().normal);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesWithoutOcclusion) {
  EXPECT_LT(slope_error(shapes::icosphere(2), {}, Loss::kSquare), 1e-5);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesWithOcclusionAndTwoReflections) {
  EXPECT_LT(slope_error(shapes::torus(16, 10), {}, Loss::kSquare), 1e-5);
  EXPECT_LT(slope_error(shapes::trihedral(4), {}, Loss::kSquare), 1e-5);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesForPlaces) {
  const SurfaceMesh wall = shapes::concave_facade(0.3, 8);
  const Goal line{GoalKind::kLine, {-1.0, -2.0, 0.0}, {1.0, -2.0, 0.0}};
  for (const Loss loss : {Loss::kSquare, Loss::kNegativeSquare, Loss::kInverse}) {
    EXPECT_LT(slope_error(wall, {GoalKind::kPoint, {0.0, -2.0, 0.0}, {}}, loss), 1e-5);
    EXPECT_LT(slope_error(wall, line, loss), 1e-5);
  }
}

TEST(ReflectionEnergy, HitsBelowTheFloorHardlyChangeTheGradient) {
  for (const SurfaceMesh& mesh : {shapes::torus(32, 20), shapes::trihedral(8)}) {
    const DirectionSet directions = band_directions(0.35, {6, 24, 0.1});
    const LightPaths paths(mesh, Goal{}, directions, kGatherDirections, Executor::cpu(2));
    const Eigen::Matrix3Xd& normals = paths.faces().normal;
    const ReflectionEnergy all(paths, Loss::kSquare, Executor::cpu(2), 0.0);
    const ReflectionEnergy most(paths, Loss::kSquare, Executor::cpu(2));
    Eigen::Matrix3Xd exact;
    Eigen::Matrix3Xd gradient;
    EXPECT_NEAR(all.value_and_gradient(normals, exact), most.value_and_gradient(normals, gradient),
                1e-6);
    EXPECT_LT((gradient - exact).norm(), 0.01 * exact.norm());
  }
}

TEST(ReflectionEnergy, FacesAddUpToTheValueAndToThatOfTheGradient) {
  const SurfaceMesh mesh = shapes::torus(24, 12);
  const LightPaths paths(mesh, Goal{}, band_directions(0.35, {3, 12, 0.0}), 64, Executor::cpu(2));
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2));
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  Eigen::Matrix3Xd gradient;
  const double value = energy.value_and_gradient(normals, gradient);
  EXPECT_NEAR(energy.by_face(normals).sum(), value, 1e-12);
  EXPECT_GT(value, 1.001 * energy.direct_value(normals));
}

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

/// One face whose normal has this elevation.
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

/// Radiance of a face near the edge of a dihedral, for light across it; the plates are some hundred
/// times as long and wide as the face's distance from the edge.
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

constexpr int kRuns = 100;

/// Mean and standard error of the estimates; every run gives the gradient's product with a fixed
/// direction.
struct Estimate {
  double mean = 0.0;
  double error = 0.0;
};

Estimate estimate(const PathEstimator& estimator, const Eigen::Matrix3Xd& normals,
                  const Eigen::Matrix3Xd& direction) {
  double sum = 0.0;
  double squares = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const double x =
        estimator.gradient(normals, static_cast<std::uint64_t>(run)).cwiseProduct(direction).sum();
    sum += x;
    squares += x * x;
  }
  const double mean = sum / kRuns;
  return {mean, std::sqrt((squares / kRuns - mean * mean) / kRuns)};
}

void expect_unbiased(const SurfaceMesh& mesh) {
  const LightField field = make_light_field(ReflectOptions{});
  const LightPaths paths(mesh, field.goal, band_directions(field.elevation, {16, 96, 0.0}), 512,
                         Executor::cpu(2));
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2), 0.0);
  Eigen::Matrix3Xd exact;
  EXPECT_GT(energy.value_and_gradient(normals, exact), 0.0);
  const PathEstimator estimator(mesh, field, Loss::kSquare, Executor::cpu(2));
  const Estimate sampled = estimate(estimator, normals, exact);
  EXPECT_NEAR(sampled.mean, exact.squaredNorm(), 4.0 * sampled.error + 0.01 * exact.squaredNorm());
}

TEST(PathEstimator, IsUnbiasedForOneReflection) { expect_unbiased(shapes::icosphere(2)); }

TEST(PathEstimator, IsUnbiasedForTwoReflections) { expect_unbiased(shapes::trihedral(3)); }

TEST(PathEstimator, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  const LightField field = make_light_field(ReflectOptions{});
  const Eigen::Matrix3Xd normals = measure_faces(mesh).normal;
  EXPECT_EQ(PathEstimator(mesh, field, Loss::kSquare, Executor::serial()).gradient(normals, 3),
            PathEstimator(mesh, field, Loss::kSquare, Executor::cpu(2)).gradient(normals, 3));
}

}  // namespace

}  // namespace lensforge::reflect
