// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace lensforge {

enum class OutlineKind { kCircle, kRoundedRectangle, kPolygon };

/// Edge of a lens seen along z: one closed line inside the rectangle OpticalSetup::lens_size. Light
/// passes only inside it.
struct Outline {
  OutlineKind kind = OutlineKind::kCircle;
  double radius = 0.0;  ///< Radius of a circle or of rounded corners, mm.
  /// Corners of the closed polygon that bounds the light, counter-clockwise, mm, lens frame. Chords
  /// of an arc are within 2.4e-6 of its radius: a circle of 100 mm is exact to 0.12 µm, its area to
  /// 3.2e-6 (OutlineTest.CircleIsRoundToItsErrorBound).
  std::vector<Eigen::Vector2d> points;

  friend bool operator==(const Outline&, const Outline&) = default;
};

/// Maximum number of corners of a polygon: with more, triangles are finer than any tool.
inline constexpr std::size_t kMaxOutlinePoints = 20000;

/// The largest circle centred in the rectangle [0, size.x] × [0, size.y].
Outline circle_outline(const Eigen::Vector2d& size);

/// The rectangle with rounded corners. @pre 0 < radius ≤ half of the shorter side.
Outline rounded_outline(const Eigen::Vector2d& size, double radius);

/// A polygon in any unit and either direction, made counter-clockwise, centred in the rectangle and
/// scaled uniformly to the largest size that fits. @pre at least 3 points.
Outline polygon_outline(const Eigen::Vector2d& size, std::vector<Eigen::Vector2d> points);

/// Signed area of a closed polygon; positive if counter-clockwise.
double polygon_area(const std::vector<Eigen::Vector2d>& points);

/// An outline in a few words: "circle of 100 mm", "corners of radius 5 mm".
std::string outline_words(const Outline& outline);

/// Returns one clause saying why a closed polygon cannot be a lens's edge (too few or too many
/// corners, a side without length, sides that cross or touch, no area); nothing if it can.
std::optional<std::string> polygon_fault(const std::vector<Eigen::Vector2d>& points);

}  // namespace lensforge
