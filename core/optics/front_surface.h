// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/compute/host_device.h"

namespace lensforge {

/// Entry face of a lens that is a part of a sphere. Millimetres, lens frame.
struct SphericalFront {
  double radius = 0.0;  ///< Above 0 convex, bulging towards −z; below 0 concave.
  Eigen::Vector3d apex{0.0, 0.0, 0.0};

  friend bool operator==(const SphericalFront&, const SphericalFront&) = default;
};

/// z of the front at a place and its derivatives.
struct FrontPoint {
  double z;
  Eigen::Vector2d gradient;
  Eigen::Vector3d bend;  ///< ∂²z/∂x², ∂²z/∂x∂y, ∂²z/∂y²
};

/// The front as a height field z = h(x, y): with ρ the distance from the apex in x and y and κ one
/// over the radius, h = apex + κρ² / (1 + √(1 − κ²ρ²)). Without a curvature it is the plane z = 0.
class FrontSurface {
 public:
  FrontSurface() = default;
  explicit FrontSurface(const SphericalFront& front)
      : apex_(front.apex), curvature_(1.0 / front.radius) {}

  /// True where the height field has a point.
  [[nodiscard]] LF_HD bool covers(const Eigen::Vector2d& xy) const {
    return cosine_squared(xy) > 0;
  }

  /// @pre covers(xy).
  [[nodiscard]] LF_HD double height(const Eigen::Vector2d& xy) const {
    const double sag = curvature_ * across(xy).squaredNorm();
    return apex_.z() + sag / (1.0 + std::sqrt(cosine_squared(xy)));
  }
  /// @pre covers(xy).
  [[nodiscard]] LF_HD FrontPoint at(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d r = across(xy);
    const double by_cosine = 1.0 / std::sqrt(cosine_squared(xy));
    const Eigen::Vector2d g = (curvature_ * by_cosine) * r;
    const double k = curvature_ * by_cosine;
    return {height(xy), g,
            k * Eigen::Vector3d(1.0 + g.x() * g.x(), g.x() * g.y(), 1.0 + g.y() * g.y())};
  }

 private:
  [[nodiscard]] LF_HD Eigen::Vector2d across(const Eigen::Vector2d& xy) const {
    return {xy.x() - apex_.x(), xy.y() - apex_.y()};
  }
  /// Of the normal's angle with z.
  [[nodiscard]] LF_HD double cosine_squared(const Eigen::Vector2d& xy) const {
    return 1.0 - curvature_ * curvature_ * across(xy).squaredNorm();
  }

  Eigen::Vector3d apex_{0.0, 0.0, 0.0};
  double curvature_ = 0.0;  ///< 1/mm
};

}  // namespace lensforge
