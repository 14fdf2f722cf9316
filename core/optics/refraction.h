// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"

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

/// Adjoint of refract() with respect to the incident direction: a_bar for a given b_bar.
LF_HD inline Eigen::Vector3d refract_adjoint_by_incident(const Eigen::Vector3d& a,
                                                         const Eigen::Vector3d& n, double eta,
                                                         const Eigen::Vector3d& b_bar) {
  const double c = n.dot(a);
  const double k_by_c = eta * eta * c / std::sqrt(refracted_cosine_squared(c, eta)) - eta;
  return eta * b_bar + (n.dot(b_bar) * k_by_c) * n;
}

/// A ray after a surface of unit normal n, b = k n + η a with k = √s − ηc, and intermediate values
/// for its adjoint. Light along +z, a = ẑ, takes fewer operations.
struct RefractedBeam {
  double root;       ///< √s
  double inverse_z;  ///< 1/b_z
  double k;
  Eigen::Vector2d m;  ///< Slope (dx/dz, dy/dz).

  /// @pre n_z > 0 and no total internal reflection.
  LF_HD RefractedBeam(const Eigen::Vector3d& n, double eta)
      : root(std::sqrt(refracted_cosine_squared(n.z(), eta))),
        inverse_z(1.0 / (root * n.z() + eta * (1.0 - n.z() * n.z()))),
        k(root - eta * n.z()),
        m(k * inverse_z * n.x(), k * inverse_z * n.y()) {}

  /// The ray b = a + k n after a mirror, k = −2c (Sun et al., Appendix D). @pre b_z > 0.
  [[nodiscard]] LF_HD static RefractedBeam reflected(const Eigen::Vector3d& a,
                                                     const Eigen::Vector3d& n) {
    RefractedBeam beam;
    beam.k = -2.0 * n.dot(a);
    const Eigen::Vector3d b = beam.k * n + a;
    beam.inverse_z = 1.0 / b.z();
    beam.m = beam.inverse_z * b.head<2>();
    return beam;
  }

  /// @pre those of refract(), and b_z > 0.
  LF_HD RefractedBeam(const Eigen::Vector3d& a, const Eigen::Vector3d& n, double eta)
      : root(std::sqrt(refracted_cosine_squared(n.dot(a), eta))),
        inverse_z(0.0),
        k(root - eta * n.dot(a)) {
    const Eigen::Vector3d b = k * n + eta * a;
    inverse_z = 1.0 / b.z();
    m = inverse_z * b.head<2>();
  }

  /// Derivative by b of a scalar whose derivative by m is m_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d direction_bar(const Eigen::Vector2d& m_bar) const {
    return inverse_z * Eigen::Vector3d(m_bar.x(), m_bar.y(), -m.dot(m_bar));
  }
  /// Adjoint of n ↦ m: n_bar for a given m_bar.
  [[nodiscard]] LF_HD Eigen::Vector3d adjoint(const Eigen::Vector3d& n, double eta,
                                              const Eigen::Vector2d& m_bar) const {
    const Eigen::Vector3d b_bar = direction_bar(m_bar);
    const double k_by_nz = eta * eta * n.z() / root - eta;
    Eigen::Vector3d n_bar = k * b_bar;
    n_bar.z() += n.dot(b_bar) * k_by_nz;
    return n_bar;
  }
  /// Derivative of a lens's k by c.
  [[nodiscard]] LF_HD double k_by_cosine(double c, double eta) const {
    return eta * eta * c / root - eta;
  }

 private:
  LF_HD RefractedBeam() : root(0.0), inverse_z(0.0), k(0.0), m(0.0, 0.0) {}
};

/// Adjoint of the mirror's b = a − 2 (n·a) n by the normal, and by the incident direction.
LF_HD inline Eigen::Vector3d reflect_adjoint(const Eigen::Vector3d& a, const Eigen::Vector3d& n,
                                             const Eigen::Vector3d& b_bar) {
  return -2.0 * (n.dot(b_bar) * a + n.dot(a) * b_bar);
}
LF_HD inline Eigen::Vector3d reflect_adjoint_by_incident(const Eigen::Vector3d& n,
                                                         const Eigen::Vector3d& b_bar) {
  return b_bar - (2.0 * n.dot(b_bar)) * n;
}

}  // namespace lensforge
