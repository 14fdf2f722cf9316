// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "core/compute/scalar.h"

namespace lensforge {

// Notation: a incident and n normal unit vectors, c = n·a, η = n_inside / n_outside,
// s = 1 + η²(c² − 1) the squared cosine of the refracted angle, b refracted direction,
// m = (b_x, b_y)/b_z its slope. A bar (…_bar) is the derivative of a scalar by that quantity. T is
// a double, or a vector of the doubles of several rays (core/compute/lanes.h), each with the same
// bits.

/// cos² of the angle of refraction (Sun et al., Eq. 29); negative means total internal reflection.
template <class T>
LF_HD LF_INLINE T refracted_cosine_squared(const T& normal_dot_incident, double eta) {
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
template <class T>
struct RefractedBeamOf {
  T root;       ///< √s
  T inverse_z;  ///< 1/b_z
  T k;
  PlaneVector<T> m;  ///< Slope (dx/dz, dy/dz).

  /// @pre n_z > 0 and no total internal reflection.
  LF_HD LF_INLINE RefractedBeamOf(const SpaceVector<T>& n, double eta)
      : root(root_of<T>(refracted_cosine_squared<T>(n.z(), eta))),
        inverse_z(1.0 / (root * n.z() + eta * (1.0 - n.z() * n.z()))),
        k(root - eta * n.z()),
        m{k * inverse_z * n.x(), k * inverse_z * n.y()} {}

  /// The ray b = a + k n after a mirror, k = −2c (Sun et al., Appendix D). @pre b_z > 0.
  [[nodiscard]] LF_HD LF_INLINE static RefractedBeamOf reflected(const SpaceVector<T>& a,
                                                                 const SpaceVector<T>& n) {
    RefractedBeamOf beam;
    beam.k = -2.0 * n.dot(a);
    beam.aim(beam.k * n + a);
    return beam;
  }

  /// @pre those of refract(), and b_z > 0.
  LF_HD LF_INLINE RefractedBeamOf(const SpaceVector<T>& a, const SpaceVector<T>& n, double eta)
      : root(root_of<T>(refracted_cosine_squared<T>(n.dot(a), eta))),
        inverse_z{},
        k(root - eta * n.dot(a)),
        m{T{}, T{}} {
    aim(k * n + eta * a);
  }

  /// Derivative by b of a scalar whose derivative by m is m_bar.
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> direction_bar(const PlaneVector<T>& m_bar) const {
    return inverse_z * SpaceVector<T>(m_bar.x(), m_bar.y(), -m.dot(m_bar));
  }
  /// Adjoint of n ↦ m: n_bar for a given m_bar.
  [[nodiscard]] LF_HD LF_INLINE SpaceVector<T> adjoint(const SpaceVector<T>& n, double eta,
                                                       const PlaneVector<T>& m_bar) const {
    const SpaceVector<T> b_bar = direction_bar(m_bar);
    const T k_by_nz = eta * eta * n.z() / root - eta;
    SpaceVector<T> n_bar = k * b_bar;
    n_bar.z() += n.dot(b_bar) * k_by_nz;
    return n_bar;
  }
  /// Derivative of a lens's k by c.
  [[nodiscard]] LF_HD LF_INLINE T k_by_cosine(const T& c, double eta) const {
    return eta * eta * c / root - eta;
  }

 private:
  LF_HD LF_INLINE RefractedBeamOf() : root{}, inverse_z{}, k{}, m{T{}, T{}} {}
  LF_HD LF_INLINE void aim(const SpaceVector<T>& b) {
    inverse_z = 1.0 / b.z();
    m = {inverse_z * b.x(), inverse_z * b.y()};
  }
};
using RefractedBeam = RefractedBeamOf<double>;

/// Adjoint of the mirror's b = a − 2 (n·a) n by the normal, and by the incident direction.
template <class T = double>
LF_HD LF_INLINE SpaceVector<T> reflect_adjoint(const SpaceVector<T>& a, const SpaceVector<T>& n,
                                               const SpaceVector<T>& b_bar) {
  return -2.0 * (n.dot(b_bar) * a + n.dot(a) * b_bar);
}
LF_HD inline Eigen::Vector3d reflect_adjoint_by_incident(const Eigen::Vector3d& n,
                                                         const Eigen::Vector3d& b_bar) {
  return b_bar - (2.0 * n.dot(b_bar)) * n;
}

/// Gradient (∂z/∂x, ∂z/∂y) of the surface that sends parallel light along +z into a ray of slope
/// m = (dx/dz, dy/dz): the inverse of RefractedBeam. By Snell's law b − ηẑ is parallel to the
/// normal, so the gradient is b_xy / (η − b_z).
LF_HD inline Eigen::Vector2d refracting_gradient(const Eigen::Vector2d& m, double eta) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return b.head<2>() / (eta - b.z());
}

/// The same for light that travels along the unit vector a inside the lens, refracted by Snell's
/// law with b − ηa parallel to the normal.
LF_HD inline Eigen::Vector2d refracting_gradient(const Eigen::Vector2d& m, double eta,
                                                 const Eigen::Vector3d& a) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return (b.head<2>() - eta * a.head<2>()) / (eta * a.z() - b.z());
}

/// The same for a mirror that light along the unit vector a falls on: b − a is parallel to the
/// normal.
LF_HD inline Eigen::Vector2d reflecting_gradient(const Eigen::Vector2d& m,
                                                 const Eigen::Vector3d& a) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return (a.head<2>() - b.head<2>()) / (b.z() - a.z());
}

/// Share of unpolarised light that goes through a face between a medium of index η and air, by
/// Fresnel's formulas, and its derivative by c, the cosine of the angle to the normal on the
/// medium's side. The face is uncoated; both directions have the same share. 0 at total internal
/// reflection.
LF_HD inline ValueSlope transmittance(double c, double eta) {
  const double s = refracted_cosine_squared(c, eta);
  if (!(c > 0.0) || !(s > 0.0)) return {0.0, 0.0};
  const double t = std::sqrt(s);
  const double across = eta * c + t;
  const double along = c + eta * t;
  const double r_across = (eta * c - t) / across;
  const double r_along = (c - eta * t) / along;
  // ∂t/∂c = η²c/t; both amplitudes have the numerator 2η(t − c ∂t/∂c) over their sum squared.
  const double numerator = 2.0 * eta * (t - eta * eta * c * c / t);
  const double slope = numerator * (r_across / (across * across) + r_along / (along * along));
  return {1.0 - 0.5 * (r_across * r_across + r_along * r_along), -slope};
}

/// Share of light at normal incidence that is reflected by both faces of a lens and then leaves
/// with the rest. It spreads over the picture and its surroundings: if all of it fell evenly on the
/// picture, no pixel would be darker than this share of the mean.
inline double ghost_share(double eta) {
  const double reflected = 1.0 - transmittance(1.0, eta).value;
  return reflected * reflected;
}

/// f_tir = 1/(1 + η²((n·a)² − 1)), ∞ where light is totally reflected (Sun et al., Eq. 9), as a
/// function of c = n·a.
template <class T>
LF_HD LF_INLINE ValueSlopeOf<T> reflection_barrier(const T& c, double eta) {
  const T none{};
  const T s = refracted_cosine_squared(c, eta);
  const MaskOf<T> leaves = (s > none) & (c > none);
  const T value = 1.0 / s;
  const T slope = -2.0 * eta * eta * c / (s * s);
  return {leaves ? value : none + kInfinity, leaves ? slope : none};
}

}  // namespace lensforge
