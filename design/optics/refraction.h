// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/host_device.h"

/// Notation: a incident and n normal unit vectors, c = n·a, η = n_inside / n_outside,
/// s = 1 + η²(c² − 1) the squared cosine of the refracted angle, b refracted direction,
/// m = (b_x, b_y)/b_z its slope. A bar (…_bar) is the derivative of a scalar by that quantity.
namespace lensforge {

/// cos² of the angle of refraction (Sun et al., Eq. 29); negative means total internal reflection.
LF_HD inline double refracted_cosine_squared(double normal_dot_incident, double eta) {
  return 1.0 + eta * eta * (normal_dot_incident * normal_dot_incident - 1.0);
}

/// Direction of the refracted ray, b = n(√s − ηc) + ηa (Sun et al., Eqs. 3 and 30); unit length.
/// @pre |a| = |n| = 1, c > 0, s > 0.
LF_HD inline Eigen::Vector3d refract(const Eigen::Vector3d& a, const Eigen::Vector3d& n,
                                     double eta) {
  const double c = n.dot(a);
  const double k = std::sqrt(refracted_cosine_squared(c, eta)) - eta * c;
  return k * n + eta * a;
}

/// Adjoint of refract() with respect to the normal: n_bar for a given b_bar.
LF_HD inline Eigen::Vector3d refract_adjoint(const Eigen::Vector3d& a, const Eigen::Vector3d& n,
                                             double eta, const Eigen::Vector3d& b_bar) {
  const double c = n.dot(a);
  const double root = std::sqrt(refracted_cosine_squared(c, eta));
  const double k = root - eta * c;
  const double k_by_c = eta * eta * c / root - eta;
  return k * b_bar + (n.dot(b_bar) * k_by_c) * a;
}

/// Slope (dx/dz, dy/dz) of parallel light along +z after a surface of unit normal n.
/// @pre n_z > 0 and no total internal reflection.
LF_HD inline Eigen::Vector2d refracted_slope(const Eigen::Vector3d& n, double eta) {
  const Eigen::Vector3d b = refract(Eigen::Vector3d(0.0, 0.0, 1.0), n, eta);
  return Eigen::Vector2d(b.x(), b.y()) / b.z();
}

/// Adjoint of refracted_slope(): n_bar for a given m_bar.
LF_HD inline Eigen::Vector3d refracted_slope_adjoint(const Eigen::Vector3d& n, double eta,
                                                     const Eigen::Vector2d& m_bar) {
  const Eigen::Vector3d a(0.0, 0.0, 1.0);
  const Eigen::Vector3d b = refract(a, n, eta);
  const double inverse = 1.0 / b.z();
  const double z_bar = -(m_bar.x() * b.x() + m_bar.y() * b.y()) * inverse * inverse;
  return refract_adjoint(a, n, eta,
                         Eigen::Vector3d(m_bar.x() * inverse, m_bar.y() * inverse, z_bar));
}

}  // namespace lensforge
