// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/directions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace lensforge::reflect {
namespace {

using std::numbers::pi;

/// Nodes in −1 … 1 and weights, which sum to 2.
struct GaussRule {
  Eigen::VectorXd node;
  Eigen::VectorXd weight;
};

/// From the eigenvalues of the Legendre polynomials' recurrence (Golub & Welsch 1969).
GaussRule gauss_rule(int count) {
  Eigen::VectorXd beside(count > 1 ? count - 1 : 0);
  for (int i = 1; i < count; ++i) beside[i - 1] = i / std::sqrt(4.0 * i * i - 1.0);
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::VectorXd::Zero(count), beside);
  return {solver.eigenvalues(), 2.0 * solver.eigenvectors().row(0).transpose().cwiseAbs2()};
}

Eigen::Vector3d on_sphere(double z, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

}  // namespace

DirectionSet band_directions(double elevation, const BandSampling& sampling) {
  const GaussRule rule = gauss_rule(sampling.rows);
  const Eigen::Index count = Eigen::Index{sampling.rows} * sampling.columns;
  DirectionSet set{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count)};
  Eigen::Index at = 0;
  for (int row = 0; row < sampling.rows; ++row) {
    const double z = std::sin(elevation) * rule.node[row];
    const double first = sampling.turn + 0.5 * (row % 2);
    for (int column = 0; column < sampling.columns; ++column, ++at) {
      set.light.col(at) = on_sphere(z, 2.0 * pi * (first + column) / sampling.columns);
      set.weight[at] = 0.5 * rule.weight[row] / sampling.columns;
    }
  }
  return set;
}

Eigen::Vector3d sun_direction(double angle) {
  const Eigen::Vector3d noon = Eigen::Vector3d(0.0, -1.0, 1.0).normalized();
  return std::cos(angle) * Eigen::Vector3d::UnitX() + std::sin(angle) * noon;
}

DirectionSet sun_directions(int count) {
  Eigen::Matrix3Xd towards(3, count);
  for (int i = 0; i < count; ++i) towards.col(i) = sun_direction(pi * (i + 0.5) / count);
  return listed_directions(towards);
}

DirectionSet listed_directions(const Eigen::Matrix3Xd& towards_light) {
  const Eigen::Index count = towards_light.cols();
  return {towards_light.colwise().normalized(),
          Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count))};
}

Eigen::Matrix3Xd hemisphere_directions(int count) {
  const double golden = pi * (3.0 - std::sqrt(5.0));
  Eigen::Matrix3Xd directions(3, count);
  for (int i = 0; i < count; ++i) {
    directions.col(i) = on_sphere(1.0 - (i + 0.5) / count, golden * i);
  }
  return directions;
}

}  // namespace lensforge::reflect
