// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

#include "core/compute/host_device.h"
#include "core/optics/height_spline.h"

namespace lensforge {

/// Spherical entry face of a lens. Millimetres, lens frame.
struct SphericalFront {
  double radius = 0.0;  ///< Above 0 convex, bulging towards −z; below 0 concave.
  Eigen::Vector3d apex{0.0, 0.0, 0.0};

  friend bool operator==(const SphericalFront&, const SphericalFront&) = default;
};

/// Entry face of a lens as a height map, z = h(x, y) in the lens frame. Millimetres.
struct HeightFront {
  std::shared_ptr<const HeightSpline> spline;
  Eigen::Vector2d size{0.0, 0.0};    ///< Extent between the outermost samples.
  Eigen::Vector2d corner{0.0, 0.0};  ///< Least x and y of the samples; 0 for the lens's own.

  friend bool operator==(const HeightFront& a, const HeightFront& b) {
    return a.size == b.size && a.corner == b.corner &&
           (a.spline == b.spline || (a.spline && b.spline && *a.spline == *b.spline));
  }
};

/// A lens's entry face that is not flat.
using Front = std::variant<SphericalFront, HeightFront>;

/// Height of the front at a point, with derivatives.
struct FrontPoint {
  double z;
  Eigen::Vector2d gradient;
  Eigen::Vector3d bend;  ///< ∂²z/∂x², ∂²z/∂x∂y, ∂²z/∂y²
};

/// The front as a height field z = h(x, y). For a sphere, with ρ the distance from the apex in x
/// and y and κ one over the radius, h = apex + κρ² / (1 + √(1 − κ²ρ²)); with κ = 0 it is the plane
/// z = 0. For a height map it is a view of the spline's coefficients, which must outlive it.
/// Kernels use reading() with a copy of the coefficients in their executor's memory.
class FrontSurface {
 public:
  FrontSurface() = default;
  explicit FrontSurface(const SphericalFront& front)
      : apex_(front.apex), curvature_(1.0 / front.radius) {}
  /// @pre front.spline.
  explicit FrontSurface(const HeightFront& front)
      : apex_(front.corner.x(), front.corner.y(), 0.0),
        coefficients_(front.spline->coefficients().data()),
        columns_(front.spline->grid().columns),
        rows_(front.spline->grid().rows),
        per_mm_x_((columns_ - 1) / front.size.x()),
        per_mm_y_((rows_ - 1) / front.size.y()) {}
  explicit FrontSurface(const Front& front)
      : FrontSurface(std::visit([](const auto& one) { return FrontSurface(one); }, front)) {}

  [[nodiscard]] LF_HD bool is_height_map() const { return coefficients_ != nullptr; }
  /// The coefficients of a height map; empty for a sphere.
  [[nodiscard]] std::span<const double> coefficients() const {
    if (!is_height_map()) return {};
    const std::size_t columns = static_cast<std::size_t>(columns_) + 2 * HeightSpline::kBeyond;
    return {coefficients_, columns * (static_cast<std::size_t>(rows_) + 2 * HeightSpline::kBeyond)};
  }
  /// The same surface with its coefficients at another address. @pre is_height_map().
  [[nodiscard]] FrontSurface reading(const double* coefficients) const {
    FrontSurface other = *this;
    other.coefficients_ = coefficients;
    return other;
  }

  /// True if the front has a height there; always true for a height map.
  [[nodiscard]] LF_HD bool covers(const Eigen::Vector2d& xy) const {
    return is_height_map() || cosine_squared(xy) > 0;
  }

  /// @pre covers(xy).
  [[nodiscard]] LF_HD double height(const Eigen::Vector2d& xy) const {
    if (is_height_map()) return on_spline(xy).z;
    const double sag = curvature_ * across(xy).squaredNorm();
    return apex_.z() + sag / (1.0 + std::sqrt(cosine_squared(xy)));
  }
  /// @pre covers(xy).
  [[nodiscard]] LF_HD FrontPoint at(const Eigen::Vector2d& xy) const {
    if (is_height_map()) return on_spline(xy);
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
  /// Squared cosine of the angle between normal and z.
  [[nodiscard]] LF_HD double cosine_squared(const Eigen::Vector2d& xy) const {
    return 1.0 - curvature_ * curvature_ * across(xy).squaredNorm();
  }
  [[nodiscard]] LF_HD LF_APART FrontPoint on_spline(const Eigen::Vector2d& xy) const {
    const SplineWeights u((xy.x() - apex_.x()) * per_mm_x_, columns_);
    const SplineWeights v((xy.y() - apex_.y()) * per_mm_y_, rows_);
    double z = 0.0, by_x = 0.0, by_y = 0.0, by_xx = 0.0, by_xy = 0.0, by_yy = 0.0;
    for (int j = 0; j < 4; ++j) {
      const std::int64_t line = (v.first + j) * (columns_ + 2 * HeightSpline::kBeyond);
      double value = 0.0, slope = 0.0, bend = 0.0;
      for (int i = 0; i < 4; ++i) {
        const double c = coefficients_[line + u.first + i];
        value += u.value[i] * c;
        slope += u.slope[i] * c;
        bend += u.bend[i] * c;
      }
      z += v.value[j] * value;
      by_x += v.value[j] * slope;
      by_y += v.slope[j] * value;
      by_xx += v.value[j] * bend;
      by_xy += v.slope[j] * slope;
      by_yy += v.bend[j] * value;
    }
    return {z,
            {per_mm_x_ * by_x, per_mm_y_ * by_y},
            {per_mm_x_ * per_mm_x_ * by_xx, per_mm_x_ * per_mm_y_ * by_xy,
             per_mm_y_ * per_mm_y_ * by_yy}};
  }

  // An even number of words, so that no bytes of a kernel's argument are left unset.
  Eigen::Vector3d apex_{0.0, 0.0, 0.0};   ///< For a height map: x and y of its corner, and 0.
  double curvature_ = 0.0;                ///< Sphere only, 1/mm.
  const double* coefficients_ = nullptr;  ///< Height map only: HeightSpline::coefficients().
  std::int32_t columns_ = 0;              ///< Samples.
  std::int32_t rows_ = 0;
  double per_mm_x_ = 0.0;  ///< Sample steps per mm.
  double per_mm_y_ = 0.0;
};

}  // namespace lensforge
