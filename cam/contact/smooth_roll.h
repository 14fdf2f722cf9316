// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cam/contact/drop_curve.h"
#include "core/lens/optical_surface.h"

namespace lensforge {

/// Bounds over a part of a smooth surface.
struct SurfaceBounds {
  BendRange bend;
  double lowest = 0.0;   ///< mm
  double highest = 0.0;  ///< mm
};

/// Curvature and height bounds of a smooth surface in a hierarchy of cells.
class BoundsMap {
 public:
  /// @param bounds  of every triangle.
  /// @param cell    side of a cell, mm, > 0; enlarged if there would be too many.
  BoundsMap(const OpticalSurface& surface, std::span<const SurfaceBounds> bounds, double cell);

  /// Bounds over all of the surface in a box. @pre the box contains some of it.
  [[nodiscard]] SurfaceBounds over(const Eigen::AlignedBox2d& box) const;
  /// The same, from larger cells where the box has many: faster, and never tighter.
  [[nodiscard]] SurfaceBounds roughly_over(const Eigen::AlignedBox2d& box) const;
  /// Bounding box of the cells over a box for which `holds(cell's box, its bounds)`; empty if none.
  template <class Holds>
  [[nodiscard]] Eigen::AlignedBox2d part_where(const Eigen::AlignedBox2d& box,
                                               const Holds& holds) const {
    const Level& level = levels_.front();
    const auto [begin, end] = range_of(level, box);
    Eigen::AlignedBox2d part;
    for (std::int64_t row = begin.y(); row <= end.y(); ++row) {
      for (std::int64_t column = begin.x(); column <= end.x(); ++column) {
        const Cell& cell = level.cells[static_cast<std::size_t>(row * level.columns + column)];
        const Eigen::AlignedBox2d own = box_of(level, column, row);
        if (holds(own, cell.bounds())) part.extend(own);
      }
    }
    return part;
  }

 private:
  /// In single precision, rounded outwards.
  struct Cell {
    float least = 0.0F, largest = 0.0F, lowest = HUGE_VALF, highest = -HUGE_VALF;
    void extend(const Cell& other);
    [[nodiscard]] SurfaceBounds bounds() const { return {{least, largest}, lowest, highest}; }
  };
  struct Level {
    double cell = 0.0;  ///< Side, mm.
    std::int64_t columns = 1;
    std::int64_t rows = 1;
    std::vector<Cell> cells;
  };
  /// Cells [begin, end] along x and y.
  struct Range {
    Eigen::Array2<std::int64_t> begin, end;
  };
  [[nodiscard]] Level make_level(double cell) const;
  [[nodiscard]] Eigen::AlignedBox2d box_of(const Level& level, std::int64_t column,
                                           std::int64_t row) const {
    const Eigen::Vector2d corner =
        box_.min() +
        level.cell * Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row));
    return {corner, Eigen::Vector2d(corner + Eigen::Vector2d::Constant(level.cell))};
  }
  [[nodiscard]] Range range_of(const Level& level, const Eigen::AlignedBox2d& box) const;
  [[nodiscard]] SurfaceBounds over(const Level& level, const Eigen::AlignedBox2d& box) const;

  Eigen::AlignedBox2d box_;
  std::vector<Level> levels_;  ///< Finest first.
};

/// A smooth surface that a ball rolls on.
///
/// The height f(q) = z(q) + √(R² − |q − p|²) − R at which a point q of it holds the tip over p is
/// largest within √(2 R h) of p′, the place of the surface's rectangle nearest to p, h being the
/// maximum rise of the surface above p′: with v = q − p′, |q − p|² ≥ |p′ − p|² + v² because the
/// rectangle is convex, so f(q) ≥ f(p′) requires z(q) − z(p′) ≥ v²/(2R). Where no second derivative
/// of the surface there exceeds kMaxBend / R, f is strictly concave: there is one contact, and
/// Newton's method finds it. It depends continuously on p, and the drop surface f(q(p)) has second
/// derivatives between −b⁻ and b⁺ / (1 − b⁺R), those of the surface lying between −b⁻ and b⁺: the
/// Hessians' inverses add. At the rim of the rectangle, where the contact stays behind, the ball's
/// own flank bounds them.
class SmoothBed {
 public:
  /// @param radius   of the ball, mm, > 0.
  /// @param surface  a height field over a rectangle; must outlive the bed.
  /// @param bounds   of every triangle.
  SmoothBed(const OpticalSurface& surface, double radius, std::span<const SurfaceBounds> bounds);

  [[nodiscard]] const OpticalSurface& surface() const { return surface_; }
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] const BoundsMap& bounds() const { return bounds_; }
  /// All of the surface that can touch a ball whose axis is in a box.
  [[nodiscard]] Eigen::AlignedBox2d footprint(const Eigen::AlignedBox2d& axis) const;
  /// The same if the tip is nowhere below `tip`, mm: z(q) − tip ≥ |q − p|²/(2R).
  [[nodiscard]] Eigen::AlignedBox2d footprint(const Eigen::AlignedBox2d& axis, double tip) const;
  /// Maximum distance of a contact from p′, mm.
  [[nodiscard]] double reach(const Eigen::AlignedBox2d& axis) const;
  /// Minimum height of the tip over a box, mm, if a point of the surface is under the ball.
  [[nodiscard]] double tip_over(const Eigen::AlignedBox2d& axis,
                                const Eigen::Vector3d& point) const;

  static constexpr double kMaxBend = 0.8;

 private:
  const OpticalSurface& surface_;
  double radius_;
  BoundsMap bounds_;
};

/// Points of a curve, joined by straight lines.
struct CurveNodes {
  std::vector<double> u;                 ///< Ascending, mm.
  std::vector<double> z;                 ///< mm
  std::vector<Eigen::Vector2d> contact;  ///< Contact of the ball, mm.
  double error = 0.0;                    ///< Maximum distance of the curve from the polyline, mm.
};

/// A ball that rolls along a line over a smooth surface.
class SmoothRoll {
 public:
  SmoothRoll(const SmoothBed& bed, const AxisLine& line) : bed_(bed), line_(line) {}

  /// The drop curve from `from` to `to`, both included, to `error` mm, with nodes at most `apart`
  /// mm apart. Nothing if somewhere in between the ball may rest in more than one place or on a
  /// flank steeper than kSteepest, or leaves the surface. Short stretches are checked more finely.
  [[nodiscard]] std::optional<CurveNodes> follow(double from, double to, double error,
                                                 double apart = HUGE_VAL);

  /// Maximum distance of contact and axis, in radii.
  static constexpr double kSteepest = 0.85;

 private:
  /// A ball at rest.
  struct Rest {
    Eigen::Vector2d q{0.0, 0.0};     ///< Contact.
    Eigen::Vector2d rate{0.0, 0.0};  ///< ∂q/∂u
    double z = 0.0;                  ///< Of the surface there, mm.
    double tip = 0.0;
    double doubt = 0.0;  ///< Uncertainty of the tip, mm.

    [[nodiscard]] Eigen::Vector3d point() const { return {q.x(), q.y(), z}; }
  };
  [[nodiscard]] std::optional<Rest> rest_at(double u, const Eigen::Vector2d& guess);
  [[nodiscard]] std::optional<SurfaceShape> shape_at(const Eigen::Vector2d& q);
  /// Maximum curvature of the drop curve between two rests, 1/mm; nothing if unknown.
  [[nodiscard]] std::optional<double> sharpest(double from, const Rest& first, double to,
                                               const Rest& last, double bend) const;

  const SmoothBed& bed_;
  AxisLine line_;
  std::optional<SmoothPatch> patch_;  ///< Patch of the last shape.
  std::optional<Eigen::Vector2d> last_;
};

}  // namespace lensforge
