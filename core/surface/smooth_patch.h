// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

namespace lensforge {

/// Height of a surface above a point with all derivatives up to the second.
struct SurfaceShape {
  double z = 0.0;                                   ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< ∂z/∂x, ∂z/∂y
  Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();   ///< Second derivatives, 1/mm, symmetric.
};

/// A cubic height over a triangle seen from above.
class SmoothPatch {
 public:
  /// Bernstein coefficients over corners 0, 1, 2 in the order 300, 030, 003, 210, 120, 201, 021,
  /// 111, 102, 012.
  using Coefficients = std::array<double, 10>;

  /// @pre the corners do not lie on one line.
  SmoothPatch(const std::array<Eigen::Vector2d, 3>& corners, const Coefficients& coefficients);

  /// True if a point is on the triangle or within rounding of it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d b = to_weights_ * (xy - origin_);
    return b.x() >= -kOnPatch && b.y() >= -kOnPatch && b.x() + b.y() <= 1.0 + kOnPatch;
  }

  /// The cubic at a point, continued beyond the triangle.
  [[nodiscard]] SurfaceShape at(const Eigen::Vector2d& xy) const;

  /// Bounds of the height over the triangle, mm: a cubic stays in the hull of its coefficients.
  [[nodiscard]] double lowest() const { return lowest_; }
  [[nodiscard]] double highest() const { return highest_; }

  /// Barycentric tolerance for points outside the triangle.
  static constexpr double kOnPatch = 1e-9;

 private:
  Eigen::Vector2d origin_;  ///< Corner 0.
  double lowest_;
  double highest_;
  Eigen::Matrix2d to_weights_;  ///< Offset from corner 0 → barycentric weights of corners 1, 2.
  /// Coefficients of 1, x, y, x², xy, y², x³, x²y, xy², y³ relative to the origin.
  std::array<double, 10> power_{};
};

}  // namespace lensforge
