// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/compute/host_device.h"
#include "core/image/rasters.h"

/// Notation: t position along an axis in samples, 0 … n − 1 from the least coordinate; B_i the
/// uniform cubic B-spline around t = i; c_i its coefficient; m_i = c_{i−1} − 2 c_i + c_{i+1} the
/// second derivative at t = i.
namespace lensforge {

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

}  // namespace lensforge
