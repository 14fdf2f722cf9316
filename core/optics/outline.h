// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace lensforge {

enum class OutlineKind { kCircle, kRoundedRectangle, kPolygon };

/// Edge of a lens seen along z, where it is not the whole rectangle of OpticalSetup::lens_size: one
/// closed line inside of that rectangle. Light passes inside of it only.
struct Outline {
  OutlineKind kind = OutlineKind::kCircle;
  double radius = 0.0;  ///< Of a circle or of a rectangle's corners, mm.
  /// Corners of the closed polygon that all light is counted by, counter-clockwise, mm, lens frame.
  /// Chords of an arc are within 2.4e-6 of its radius: a circle of 100 mm is right to 0.12 µm and
  /// its area to 3.2e-6 (OutlineTest.CircleIsRoundToItsErrorBound).
  std::vector<Eigen::Vector2d> points;

  friend bool operator==(const Outline&, const Outline&) = default;
};

/// Most corners of a polygon: beyond it triangles are finer than any tool.
inline constexpr std::size_t kMaxOutlinePoints = 20000;

/// The largest circle in the middle of a rectangle [0, size.x] × [0, size.y].
Outline circle_outline(const Eigen::Vector2d& size);

/// The rectangle itself with rounded corners. @pre 0 < radius ≤ half of the shorter side.
Outline rounded_outline(const Eigen::Vector2d& size, double radius);

/// A polygon in any unit and either direction, turned counter-clockwise, moved and scaled evenly so
/// that it is as large as the rectangle allows, in its middle. @pre at least 3 points.
Outline polygon_outline(const Eigen::Vector2d& size, std::vector<Eigen::Vector2d> points);

/// Signed area of a closed polygon, above 0 counter-clockwise.
double polygon_area(const std::vector<Eigen::Vector2d>& points);

/// An outline in a few words: "circle of 100 mm", "corners of radius 5 mm".
std::string outline_words(const Outline& outline);

/// Why a closed polygon cannot be a lens's edge: too few or too many corners, a side without
/// length, sides that cross or touch, no area. One clause; nothing if it can.
std::optional<std::string> polygon_fault(const std::vector<Eigen::Vector2d>& points);

}  // namespace lensforge
