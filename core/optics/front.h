// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "core/compute/host_device.h"
#include "core/image/rasters.h"

namespace lensforge {

class Description;
struct OpticalSetup;

// Height maps. Notation: t position along an axis in samples, 0 … n − 1 from the least coordinate;
// B_i the uniform cubic B-spline around t = i; c_i its coefficient; m_i = c_{i−1} − 2 c_i + c_{i+1}
// the second derivative at t = i.

/// Bicubic spline through a grid of heights, twice continuously differentiable. At the edges it is
/// "not a knot" (de Boor 1978, ch. IV): the two outermost cells of a line share one cubic, so that
/// the error is of fourth order up to the edge. Beyond the edge the curvature falls to zero within
/// one sample's distance; from there the spline is straight.
class HeightSpline {
 public:
  /// Samples beyond each edge that have coefficients.
  static constexpr int kBeyond = 2;

  /// @pre at least kMinHeightSamples each way, in the order of read_heights(); all finite.
  explicit HeightSpline(HeightGrid grid);

  [[nodiscard]] const HeightGrid& grid() const { return grid_; }
  /// c of B_i(x) B_j(y) in mm, (columns + 2 kBeyond) × (rows + 2 kBeyond), i = −kBeyond …, row by
  /// row from the least y.
  [[nodiscard]] const std::vector<double>& coefficients() const { return coefficients_; }
  /// One coefficient. @pre −kBeyond ≤ i < columns + kBeyond; the same for j.
  [[nodiscard]] double coefficient(int i, int j) const {
    const std::ptrdiff_t width = grid_.columns + 2 * kBeyond;
    return coefficients_[static_cast<std::size_t>((j + kBeyond) * width + i + kBeyond)];
  }
  /// The coefficients of n samples along an axis as a matrix, (n + 2 kBeyond) × n. Both axes
  /// together: C = X S Yᵀ, with the columns of S and C along y. @pre n ≥ kMinHeightSamples.
  static Eigen::MatrixXd coefficient_matrix(int samples);
  [[nodiscard]] float lowest() const;  ///< Minimum of the samples.
  [[nodiscard]] float highest() const;

  friend bool operator==(const HeightSpline& a, const HeightSpline& b) {
    return a.grid_ == b.grid_;
  }

 private:
  HeightGrid grid_;
  std::vector<double> coefficients_;
};

/// Values and derivatives by t of the four B-splines that are not 0 at a point, or of their
/// straight continuation.
struct SplineWeights {
  std::int64_t first;  ///< Index of the first coefficient in HeightSpline::coefficients().
  double value[4];
  double slope[4];
  double bend[4];

  LF_HD SplineWeights(double t, std::int64_t samples) {
    const auto last = static_cast<double>(samples);
    double inside = t > -1.0 ? t : -1.0;  // Also if t is NaN.
    if (inside > last) inside = last;
    auto cell = static_cast<std::int64_t>(inside + 1.0) - 1;
    if (cell > samples - 1) cell = samples - 1;
    first = cell - 1 + HeightSpline::kBeyond;
    const double s = inside - static_cast<double>(cell);
    const double r = 1.0 - s;
    set(0, r * r * r / 6.0, -0.5 * r * r, r);
    set(1, 2.0 / 3.0 - s * s * (1.0 - 0.5 * s), s * (1.5 * s - 2.0), 3.0 * s - 2.0);
    set(2, 2.0 / 3.0 - r * r * (1.0 - 0.5 * r), r * (2.0 - 1.5 * r), 3.0 * r - 2.0);
    set(3, s * s * s / 6.0, 0.5 * s * s, s);
    for (int k = 0; k < 4; ++k) value[k] += (t - inside) * slope[k];
  }

 private:
  LF_HD void set(int k, double of_value, double of_slope, double of_bend) {
    value[k] = of_value;
    slope[k] = of_slope;
    bend[k] = of_bend;
  }
};

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

void describe(Description& d, SphericalFront& front);

/// Height of the front at a point, with derivatives.
struct FrontPoint {
  double z;
  Eigen::Vector2d gradient;
  Eigen::Vector3d bend;  ///< ∂²z/∂x², ∂²z/∂x∂y, ∂²z/∂y²
};

/// Derivatives by the front's height and gradient at a point.
struct FrontBar {
  double height = 0.0;
  Eigen::Vector2d gradient{0.0, 0.0};
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
  // Their coefficients would end with the expression.
  explicit FrontSurface(HeightFront&&) = delete;
  explicit FrontSurface(Front&&) = delete;

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
  /// Adjoint of a height map's coefficients ↦ at(xy).z and .gradient: adds to their derivatives,
  /// which are in the order of coefficients(). @pre is_height_map().
  LF_HD void at_adjoint(const Eigen::Vector2d& xy, const FrontBar& bar, double* sum) const {
    const SplineWeights u((xy.x() - apex_.x()) * per_mm_x_, columns_);
    const SplineWeights v((xy.y() - apex_.y()) * per_mm_y_, rows_);
    const Eigen::Vector2d by_t(per_mm_x_ * bar.gradient.x(), per_mm_y_ * bar.gradient.y());
    for (int j = 0; j < 4; ++j) {
      double* const line = sum + (v.first + j) * (columns_ + 2 * HeightSpline::kBeyond) + u.first;
      const double by_value = v.value[j] * bar.height + v.slope[j] * by_t.y();
      const double by_slope = v.value[j] * by_t.x();
      for (int i = 0; i < 4; ++i) line[i] += u.value[i] * by_value + u.slope[i] * by_slope;
    }
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

/// A front centred on a lens of this size. Its highest point over the lens is at z = 0. @pre
/// |radius| is longer than half of the lens's diagonal.
SphericalFront spherical_front(double radius, const Eigen::Vector2d& lens_size);

/// True if the part itself blocks the light from the source to this point of its front. Sampled: a
/// shadow shorter than a hundredth of the light's way may be missed. @pre the front covers the
/// place.
bool is_shadowed(const OpticalSetup& setup, const Eigen::Vector2d& place);

/// Distance beyond the lens's edges at which the light of a surface point enters the front, mm; 0
/// if it enters within them.
double overhang(const OpticalSetup& setup, const Eigen::Vector3d& p);

/// Distance on the screen by which the light of a surface point moves, mm, if the front is
/// displaced by 1 mm: the mean for displacements along x and y. @pre setup.front.
double shift_by_front(const OpticalSetup& setup, const Eigen::Vector3d& p);

/// Lowest z of a front over a rectangle, mm. A height map is sampled at about four points per
/// sample distance each way. @pre the front covers it.
double lowest_of(const Front& front, const Eigen::AlignedBox2d& rectangle);

/// A fault of the light behind a front, somewhere over the lens.
enum class FrontFault {
  kUnlit,  ///< The front is lit from the wrong side, or its light travels down inside.
  kFolds,  ///< Neighbouring rays meet below a height.
};

/// Checks a height map at every sample and half-way between samples. Returns nothing if its light
/// reaches height z unfolded. @pre setup.front is a height map.
std::optional<FrontFault> height_map_fault(const OpticalSetup& setup, double z);

}  // namespace lensforge
