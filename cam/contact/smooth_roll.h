// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "cam/contact/bend_map.h"
#include "cam/contact/curve_piece.h"
#include "core/surface/optical_surface.h"

namespace lensforge {

/// A smooth surface that a ball rolls on.
///
/// Where no second derivative of the surface under the ball exceeds kMaxBend / R, the height
/// f(q) = z(q) + √(R² − |q − p|²) − R at which a point q of it holds the tip over p is strictly
/// concave in q: there is one contact, and Newton's method finds it. It depends continuously on p,
/// and the drop surface f(q(p)) has second derivatives between −b⁻ and b⁺ / (1 − b⁺R), the
/// surface's own lying between −b⁻ and b⁺: the Hessians' inverses add. At the rim of the surface's
/// rectangle, where the contact stays behind, the ball's own flank bounds them.
class SmoothBed {
 public:
  /// @param radius   of the ball, mm, > 0.
  /// @param surface  a height field over a rectangle; must outlive the bed.
  /// @param bends    OpticalSurface::bend_range() of every triangle.
  SmoothBed(const OpticalSurface& surface, double radius, std::span<const BendRange> bends)
      : surface_(surface), radius_(radius), bends_(surface, bends, 0.5 * radius) {}

  [[nodiscard]] const OpticalSurface& surface() const { return surface_; }
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] const BendMap& bends() const { return bends_; }

  static constexpr double kMaxBend = 0.8;

 private:
  const OpticalSurface& surface_;
  double radius_;
  BendMap bends_;
};

/// Places of a curve, joined by straight lines.
struct CurveNodes {
  std::vector<double> u;  ///< Ascending, mm.
  std::vector<double> z;  ///< mm
  double error = 0.0;     ///< Farthest that the curve is from the polyline, mm.
};

/// A ball that rolls along a line over a smooth surface.
class SmoothRoll {
 public:
  SmoothRoll(const SmoothBed& bed, const AxisLine& line) : bed_(bed), line_(line) {}

  /// The drop curve from `from` to `to`, both included, to `error` mm; nothing if the ball may rest
  /// in more than one place or on a flank steeper than kSteepest somewhere on the way, or leaves
  /// the surface. Short ways are judged more finely.
  [[nodiscard]] std::optional<CurveNodes> follow(double from, double to, double error);

  /// Distance of contact and axis at most, in radii.
  static constexpr double kSteepest = 0.85;

 private:
  /// A ball at rest.
  struct Rest {
    Eigen::Vector2d q{0.0, 0.0};     ///< Contact.
    Eigen::Vector2d rate{0.0, 0.0};  ///< ∂q/∂u
    double tip = 0.0;
    double doubt = 0.0;  ///< Of the tip, mm.
  };
  [[nodiscard]] std::optional<Rest> rest_at(double u, const Eigen::Vector2d& guess,
                                            double steepest_bend);
  [[nodiscard]] std::optional<SurfaceShape> shape_at(const Eigen::Vector2d& q);
  /// How sharply the drop curve bends at most between two rests, 1/mm; nothing if that is open.
  [[nodiscard]] std::optional<double> sharpest(double from, const Rest& first, double to,
                                               const Rest& last, double bend) const;

  const SmoothBed& bed_;
  AxisLine line_;
  std::optional<SmoothPatch> patch_;  ///< Where the last shape was taken.
  std::optional<Eigen::Vector2d> last_;
};

}  // namespace lensforge
