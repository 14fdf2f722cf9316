// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/boundary_term.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// How far inside an unlit pixel its facet's centroid is led, pixels: a facet that ends right at
/// the border would be let go with next to no light in there.
inline constexpr double kUnlitMargin = 0.25;

/// E_unlit of the facet that is led to a pixel which no light reaches, g̃² d²: d is the distance of
/// the facet's centroid from the inner part of that pixel, in pixels, g̃ the wanted value. The
/// pixel's own error, g̃² as long as it is unlit, has no derivative: no edge passes through it. This
/// lets the error grow with the distance of the nearest facet. Ours, not of Sun et al. MAE in
/// thousandths after six rounds without and with it: 256 × 128 calligraphy 6.2 and 5.2, 64² city
/// with 2.5 vertices per pixel side 0.90 and 0.45.
/// Adds weight × derivative to `bar`, returns the value.
/// @param pixel  row by row from the top of a picture of `columns`.
LF_HD inline double unlit_term(const ImageTriangle& t, std::int64_t pixel, std::int64_t columns,
                               double wanted, double weight, ImageTriangle& bar) {
  const std::int64_t row = pixel / columns;
  const std::int64_t column = pixel % columns;
  const Eigen::Vector2d inner(static_cast<double>(column) + kUnlitMargin,
                              static_cast<double>(row) + kUnlitMargin);
  const double side = 1.0 - 2.0 * kUnlitMargin;
  const Eigen::Vector2d offset = excess_outside((t.p0 + t.p1 + t.p2) / 3.0 - inner, side, side);
  const double stiffness = wanted * wanted;
  const Eigen::Vector2d corner_bar = (2.0 / 3.0 * weight * stiffness) * offset;
  bar.p0 += corner_bar;
  bar.p1 += corner_bar;
  bar.p2 += corner_bar;
  return stiffness * offset.squaredNorm();
}

}  // namespace lensforge
