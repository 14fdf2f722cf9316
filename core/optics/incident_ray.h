// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/compute/host_device.h"

namespace lensforge {

/// The ray that reaches a surface point, and its derivatives by that point: everything that is
/// costly to find if the light's direction varies. Moving the point along its ray changes nothing,
/// so derivatives by x and y suffice.
///
/// Notation: p the point, a the ray's unit direction there, m = (a_x, a_y)/a_z its slope, e the
/// point where it enters the lens, x the x and y of e, ∇h the front's gradient there. A bar (…_bar)
/// is a derivative by that quantity. All NaN if no ray reaches p.
struct IncidentRay {
  Eigen::Vector2d m;
  Eigen::Vector2d x;         ///< mm
  double z;                  ///< z of e, mm.
  double a_z;                ///< Negative for a mirror's light.
  Eigen::Vector2d gradient;  ///< ∇h
  Eigen::Matrix2d m_by_p;    ///< ∂m/∂(p_x, p_y), 1/mm
  Eigen::Matrix2d x_by_p;    ///< ∂x/∂(p_x, p_y)

  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d direction() const {
    return {a_z * m.x(), a_z * m.y(), a_z};
  }
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d entry() const { return {x.x(), x.y(), z}; }

  /// Adjoint of p ↦ direction(): the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d direction_adjoint(
      const Eigen::Vector3d& a_bar) const {
    // a is w/|w| of w = (m, 1), or its opposite: ∂a/∂w = a_z (1 − a aᵀ).
    const double along = a_z * (m.x() * a_bar.x() + m.y() * a_bar.y() + a_bar.z());
    const Eigen::Vector2d m_bar(a_z * (a_bar.x() - along * a_z * m.x()),
                                a_z * (a_bar.y() - along * a_z * m.y()));
    return by_point(m_by_p, m_bar);
  }
  /// Adjoint of p ↦ entry(): the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d entry_adjoint(const Eigen::Vector3d& e_bar) const {
    return place_adjoint(
        {e_bar.x() + gradient.x() * e_bar.z(), e_bar.y() + gradient.y() * e_bar.z()});
  }
  /// Adjoint of p ↦ x: the derivative by p.
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d place_adjoint(const Eigen::Vector2d& x_bar) const {
    return by_point(x_by_p, x_bar);
  }

 private:
  [[nodiscard]] LF_HD LF_INLINE Eigen::Vector3d by_point(const Eigen::Matrix2d& change,
                                                         const Eigen::Vector2d& bar) const {
    const double by_x = change(0, 0) * bar.x() + change(1, 0) * bar.y();
    const double by_y = change(0, 1) * bar.x() + change(1, 1) * bar.y();
    return {by_x, by_y, -(m.x() * by_x + m.y() * by_y)};
  }
};

/// Cached rays to a triangle's corners; null if not computed.
struct CornerRays {
  const IncidentRay* r0 = nullptr;
  const IncidentRay* r1 = nullptr;
  const IncidentRay* r2 = nullptr;
};

/// Rays to all vertices of a mesh; null for parallel light.
struct VertexRays {
  const IncidentRay* of = nullptr;

  [[nodiscard]] LF_HD const IncidentRay* at(std::int64_t vertex) const {
    return of != nullptr ? of + vertex : nullptr;
  }
  [[nodiscard]] LF_HD CornerRays at(const int* triangle) const {
    return {at(triangle[0]), at(triangle[1]), at(triangle[2])};
  }
};

}  // namespace lensforge
