// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "core/compute/host_device.h"
#include "core/optics/incident_ray.h"

/// Light from a point.
///
/// Notation: a, b, c vectors from the source to the corners of a triangle; D depth of the source
/// below a flat front, T height of a point above it, x its lateral offset from the source; η
/// refractive index behind the front; μx slope of the ray behind the front, r = |x|². A bar (…_bar)
/// is a derivative by that quantity.
namespace lensforge {

/// a × b; GCC 12 leaves Eigen's as a call.
LF_HD inline Eigen::Vector3d cross_product(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
          a.x() * b.y() - a.y() * b.x()};
}

/// The two factors of a solid angle, tan(Ω/2) = N/D (Van Oosterom and Strackee 1983, Eq. 8).
struct SolidAngle {
  double la;  ///< |a|
  double lb;
  double lc;
  double n;  ///< a·(b × c)
  double d;  ///< |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|

  LF_HD LF_INLINE SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& c)
      : la(a.norm()),
        lb(b.norm()),
        lc(c.norm()),
        // Differences first: for a distant facet, products of whole vectors lose digits.
        n(a.dot(cross_product(b - a, c - a))),
        d(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) {}

  /// Ω, steradian; positive where a, b, c turn counter-clockwise seen along their sum.
  [[nodiscard]] LF_HD double value() const {
    const double x = n / d;
    // atan by its series: a facet's x is far below the bound, where the next term is 1e-18.
    if (d > 0.0 && std::fabs(x) < 5e-3) {
      const double y = x * x;
      return 2.0 * x * (1.0 - y * (1.0 / 3.0 - y * (0.2 - y / 7.0)));
    }
    return 2.0 * std::atan2(n, d);
  }
};

/// Derivatives by the three vectors.
struct VectorsBar {
  Eigen::Vector3d a{0.0, 0.0, 0.0};
  Eigen::Vector3d b{0.0, 0.0, 0.0};
  Eigen::Vector3d c{0.0, 0.0, 0.0};
};

/// Derivative of SolidAngle(a, b, c).value() × bar by the three vectors:
/// dΩ = 2 (D dN − N dD) / (N² + D²).
LF_HD LF_INLINE VectorsBar solid_angle_adjoint(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                               const Eigen::Vector3d& c, double bar) {
  const SolidAngle angle(a, b, c);
  const double s = 2.0 * bar / (angle.n * angle.n + angle.d * angle.d);
  const double n_bar = s * angle.d;
  const double d_bar = -s * angle.n;
  const double by_a = (angle.lb * angle.lc + b.dot(c)) / angle.la;
  const double by_b = (angle.lc * angle.la + c.dot(a)) / angle.lb;
  const double by_c = (angle.la * angle.lb + a.dot(b)) / angle.lc;
  return {n_bar * cross_product(b, c) + d_bar * (by_a * a + angle.lc * b + angle.lb * c),
          n_bar * cross_product(c, a) + d_bar * (by_b * b + angle.lc * a + angle.la * c),
          n_bar * cross_product(a, b) + d_bar * (by_c * c + angle.lb * a + angle.la * b)};
}

/// The ray from a point source below a flat front to a point above it, by Snell's law at the front:
/// D η μ q + T μ = 1 with q = 1/√(1 − (η² − 1) μ² r).
struct FrontRay {
  Eigen::Vector2d x;
  double height;  ///< T
  double mu;
  double mu_by_r;  ///< ∂μ/∂r

  /// @pre depth > 0, height ≥ 0, eta > 1.
  LF_HD FrontRay(const Eigen::Vector2d& across, double depth, double height_above, double eta)
      : x(across), height(height_above) {
    const double r = x.squaredNorm();
    const double k = eta * eta - 1.0;
    const double optical = depth * eta;
    // Starts with the refraction point of a ray nearly along z: the error is of third order.
    const double g = 1.0 / (depth + height / eta);
    mu = g / std::sqrt(eta * eta + k * r * g * g);
    for (int i = 0; i < kMaxSteps; ++i) {
      const double q = inverse_root(k * r);
      const double step = (optical * mu * q + height * mu - 1.0) / (optical * q * q * q + height);
      const double next = mu - step;
      // The left-hand side is convex and has its pole where k μ² r = 1.
      mu = k * r * next * next < 1.0 ? next : 0.5 * (mu + 1.0 / std::sqrt(k * r));
      if (std::fabs(step) <= kNear * mu) break;
    }
    const double q = inverse_root(k * r);
    const double steepness = optical * q * q * q + height;
    mu_by_r = -0.5 * optical * k * mu * mu * mu * q * q * q / steepness;
  }

  /// @param source  position of the source, mm.
  [[nodiscard]] LF_HD IncidentRay ray(const Eigen::Vector3d& source) const {
    const Eigen::Vector2d m = mu * x;
    Eigen::Matrix2d m_by_p;
    m_by_p << mu + 2.0 * mu_by_r * x.x() * x.x(), 2.0 * mu_by_r * x.x() * x.y(),
        2.0 * mu_by_r * x.x() * x.y(), mu + 2.0 * mu_by_r * x.y() * x.y();
    const double share = 1.0 - height * mu;
    return {m,
            {source.x() + share * x.x(), source.y() + share * x.y()},
            0.0,
            1.0 / std::sqrt(1.0 + m.squaredNorm()),
            {0.0, 0.0},
            m_by_p,
            Eigen::Matrix2d::Identity() - height * m_by_p};
  }

 private:
  /// Iteration ends at a step below this share; the error is of the order of its square. The usual
  /// lens needs one or two steps, a source close below the front at 80° eight.
  static constexpr double kNear = 1e-9;
  static constexpr int kMaxSteps = 50;

  [[nodiscard]] LF_HD double inverse_root(double kr) const {
    return 1.0 / std::sqrt(1.0 - kr * mu * mu);
  }
};

}  // namespace lensforge
