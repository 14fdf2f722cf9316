// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/compute/host_device.h"

/// A vertical ball-end mill against points, edges and facets.
///
/// Notation: R ball radius, p = (x, y) position of the tool axis, c the ball's centre, tip height
/// c.z − R. A point q of the mesh holds the ball up at
///     f(q) = q.z + √(R² − |q.xy − p|²) − R,
/// and the drop height for a set of points is the largest f over it. On a triangle f is concave, so
/// its maximum is the tangent contact inside the facet if there is one, else it lies on an edge
/// that separates the facet from the tangent contact of its plane. Facets seen from below are
/// treated as sets of points too: the orientation of a triangle does not matter.
namespace lensforge {

/// Tip height where nothing holds the ball up.
inline constexpr double kNoContact = -std::numeric_limits<double>::infinity();

/// Height of the tip that rests on point q, mm; kNoContact if q is not under the ball.
LF_HD inline double vertex_tip(const Eigen::Vector2d& p, double radius, const Eigen::Vector3d& q) {
  const double dx = q.x() - p.x();
  const double dy = q.y() - p.y();
  const double r2 = radius * radius - (dx * dx + dy * dy);
  return r2 >= 0.0 ? q.z() + std::sqrt(r2) - radius : kNoContact;
}

/// Height of the tip of a ball that touches the segment ab between its ends, mm; kNoContact if the
/// tangent point is not on it or the segment is vertical (its upper end is a vertex). In the
/// vertical plane through the segment the ball is a circle of radius r = √(R² − d²), d being the
/// axis's distance from that plane, and touches at s = s_p + r·sin(incline). The same bits for ab
/// and ba.
LF_HD inline double edge_tip(const Eigen::Vector2d& p, double radius, const Eigen::Vector3d& a,
                             const Eigen::Vector3d& b) {
  const bool a_on_top = a.z() > b.z() || (a.z() == b.z() && a.x() > b.x());
  const Eigen::Vector3d& top = a_on_top ? a : b;
  const Eigen::Vector3d u = (a_on_top ? b : a) - top;
  const double run2 = u.x() * u.x() + u.y() * u.y();
  if (!(run2 > 0.0)) return kNoContact;
  const double wx = p.x() - top.x();
  const double wy = p.y() - top.y();
  const double cross = u.x() * wy - u.y() * wx;
  const double r2 = radius * radius - cross * cross / run2;
  if (r2 < 0.0) return kNoContact;
  const double r = std::sqrt(r2);
  const double run = std::sqrt(run2);
  const double length = std::sqrt(run2 + u.z() * u.z());
  const double s = (u.x() * wx + u.y() * wy) / run + r * (u.z() / length);
  if (s < 0.0 || s > run) return kNoContact;
  // Height of the contact point plus the rest of the circle above it: both stay bounded on steep
  // edges, where extending the line to the axis would lose digits.
  return top.z() + u.z() * (s / run) + r * (run / length) - radius;
}

/// Conditioning of the tangent contact of a facet's plane.
enum class FacetShape : std::uint8_t {
  kRegular,   ///< Contact point and height are accurate: edges matter only beyond them.
  kDelicate,  ///< Thin or steep: evaluate at a point of the facet and try every edge as well.
  kNone,      ///< Vertical or without area: its edges replace it.
};

/// Smallest vertical component of a unit normal for which the height on a plane, a quotient by it,
/// is accurate to 1e-12 mm: rounding 2e-16 · 1 mm ÷ 1e-3. Also the minimum height ÷ longest side of
/// a facet whose normal decides on which side of an edge the contact lies.
inline constexpr double kRegularFacet = 1e-3;
/// Below this the facet is vertical: seen from above it is a strip 1e-12 of its size wide.
inline constexpr double kVerticalFacet = 1e-12;
/// Below this height ÷ longest side, omitting a facet lowers the tip by a negligible (1e-9
/// L)²/(2R).
inline constexpr double kThinnestFacet = 1e-9;
/// Tangent contacts this far outside, in barycentric units, count as inside, so that no gap opens
/// between coplanar neighbours; the tangent height there is too high by at most (1e-10 L)²/(2 R
/// n_z).
inline constexpr double kFacetMargin = 1e-10;

/// The tangent contact of a ball of one radius with one facet abc: for a fixed radius the contact's
/// barycentric coordinates and the tip's height are linear in p.
struct FacetContact {
  Eigen::Vector2d origin;      ///< a, seen from above.
  Eigen::Vector2d slope;       ///< ∂tip/∂p.
  Eigen::Vector2d gradient_b;  ///< ∂λ_b/∂p.
  Eigen::Vector2d gradient_c;  ///< ∂λ_c/∂p.
  double tip = kNoContact;     ///< Tip's height with the axis over a.
  double at_b = 0.0;           ///< λ_b with the axis over a.
  double at_c = 0.0;           ///< λ_c with the axis over a.
  FacetShape shape = FacetShape::kNone;
};

/// Barycentric coordinates of the point where the ball touches a facet's plane.
struct Barycentric {
  double a, b, c;
  [[nodiscard]] LF_HD bool inside() const {
    return a >= -kFacetMargin && b >= -kFacetMargin && c >= -kFacetMargin;
  }
};

/// Number of the corner opposite the longest side.
LF_HD inline int apex_of(const Eigen::Matrix3d& corners) {
  const double side0 = (corners.col(2) - corners.col(1)).squaredNorm();
  const double side1 = (corners.col(0) - corners.col(2)).squaredNorm();
  const double side2 = (corners.col(1) - corners.col(0)).squaredNorm();
  if (side0 >= side1 && side0 >= side2) return 0;
  return side1 >= side2 ? 1 : 2;
}

/// Prepares the contact of a ball with facet abc. Most accurate when bc is the longest side.
LF_HD inline FacetContact make_facet_contact(double radius, const Eigen::Vector3d& a,
                                             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  FacetContact facet;
  facet.origin = a.head<2>();
  const Eigen::Vector3d u = b - a;
  const Eigen::Vector3d v = c - a;
  const Eigen::Vector3d cross = u.cross(v);
  const double area2 = cross.norm();
  const double side2 =
      std::fmax((c - b).squaredNorm(), std::fmax(u.squaredNorm(), v.squaredNorm()));
  if (!(area2 > kThinnestFacet * side2)) return facet;
  const Eigen::Vector3d n = (cross.z() < 0.0 ? -cross : cross) / area2;
  if (!(n.z() > kVerticalFacet)) return facet;
  facet.slope = -n.head<2>() / n.z();
  facet.tip = a.z() + radius / n.z() - radius;
  facet.gradient_b = Eigen::Vector2d(v.y(), -v.x()) / cross.z();
  facet.gradient_c = Eigen::Vector2d(-u.y(), u.x()) / cross.z();
  facet.at_b = -radius * facet.gradient_b.dot(n.head<2>());
  facet.at_c = -radius * facet.gradient_c.dot(n.head<2>());
  const bool regular = n.z() >= kRegularFacet && area2 >= kRegularFacet * side2;
  facet.shape = regular ? FacetShape::kRegular : FacetShape::kDelicate;
  return facet;
}

/// Contact of the ball over p with the facet's plane. @pre facet.shape is not kNone.
LF_HD inline Barycentric contact_point(const FacetContact& facet, const Eigen::Vector2d& p) {
  const double wx = p.x() - facet.origin.x();
  const double wy = p.y() - facet.origin.y();
  const double b = facet.at_b + facet.gradient_b.x() * wx + facet.gradient_b.y() * wy;
  const double c = facet.at_c + facet.gradient_c.x() * wx + facet.gradient_c.y() * wy;
  return {1.0 - b - c, b, c};
}

/// Height of the tip of the ball that is tangent to the facet's plane, mm.
/// @pre facet.shape is kRegular.
LF_HD inline double tangent_tip(const FacetContact& facet, const Eigen::Vector2d& p) {
  const double wx = p.x() - facet.origin.x();
  const double wy = p.y() - facet.origin.y();
  return facet.tip + (facet.slope.x() * wx + facet.slope.y() * wy);
}

/// f at the point of facet abc nearest to `at` in barycentric coordinates: never above the true
/// height, and below it only by the square of the error of `at`.
LF_HD inline double tip_at(const Barycentric& at, const Eigen::Vector2d& p, double radius,
                           const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           const Eigen::Vector3d& c) {
  const double lb = std::fmin(std::fmax(at.b, 0.0), 1.0);
  const double lc = std::fmin(std::fmax(at.c, 0.0), 1.0 - lb);
  const Eigen::Vector3d q = lb * (b - a) + lc * (c - a);
  const Eigen::Vector2d local = p - a.head<2>();
  const double tip = vertex_tip(local, radius, q);
  return tip > kNoContact ? a.z() + tip : kNoContact;
}

/// Height of the tip of a ball that touches facet abc inside, mm; kNoContact if none does.
LF_HD inline double facet_tip(const FacetContact& facet, const Eigen::Vector2d& p, double radius,
                              const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& c) {
  if (facet.shape == FacetShape::kNone) return kNoContact;
  const Barycentric at = contact_point(facet, p);
  if (!at.inside()) return kNoContact;
  return facet.shape == FacetShape::kRegular ? tangent_tip(facet, p)
                                             : tip_at(at, p, radius, a, b, c);
}

/// Height of the tip of a ball that rests on a whole triangle (columns: its corners), edges and
/// corners included, mm; kNoContact if no part of it is under the ball. Error against the exact
/// maximum of f: 1e-12 mm for facets of a few millimetres not steeper than 1 : 1000
/// (BallCutter.AgreesWithTheDefinition); on steeper ones the height is exact for a p within 1e-13
/// mm.
LF_HD inline double triangle_tip(const Eigen::Vector2d& p, double radius,
                                 const Eigen::Matrix3d& corners) {
  const int apex = apex_of(corners);
  const Eigen::Vector3d a = corners.col(apex);
  const Eigen::Vector3d b = corners.col((apex + 1) % 3);
  const Eigen::Vector3d c = corners.col((apex + 2) % 3);
  double best = facet_tip(make_facet_contact(radius, a, b, c), p, radius, a, b, c);
  best = std::fmax(best, edge_tip(p, radius, a, b));
  best = std::fmax(best, edge_tip(p, radius, b, c));
  best = std::fmax(best, edge_tip(p, radius, c, a));
  best = std::fmax(best, vertex_tip(p, radius, a));
  best = std::fmax(best, vertex_tip(p, radius, b));
  return std::fmax(best, vertex_tip(p, radius, c));
}

}  // namespace lensforge
