// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

/// Refraction worked out with angles, apart from the vector formula under test.
namespace lensforge::testing {

/// Angle of refraction for an angle of incidence inside glass of index eta, radians.
inline double refracted_angle(double incidence, double eta) {
  return std::asin(eta * std::sin(incidence));
}

/// Direction after a surface of unit normal n (towards the outside).
inline Eigen::Vector3d refract_by_angles(const Eigen::Vector3d& a, const Eigen::Vector3d& n,
                                         double eta) {
  const Eigen::Vector3d axis = n.cross(a);
  const double sine = axis.norm();
  if (sine == 0.0) return a;
  const double angle = refracted_angle(std::atan2(sine, n.dot(a)), eta);
  return Eigen::AngleAxisd(angle, axis / sine) * n;
}

/// Slope of parallel light along +z after a surface of unit normal n: it is bent, away from the
/// normal, by the difference of both angles.
inline Eigen::Vector2d slope_by_angles(const Eigen::Vector3d& n, double eta) {
  const double across = std::hypot(n.x(), n.y());
  if (across == 0.0) return {0.0, 0.0};
  const double incidence = std::atan2(across, n.z());
  const double deflection = refracted_angle(incidence, eta) - incidence;
  return -std::tan(deflection) / across * Eigen::Vector2d(n.x(), n.y());
}

}  // namespace lensforge::testing
