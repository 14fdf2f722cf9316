// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <memory>

#include "core/lens/optical_surface.h"
#include "core/spline/control_net.h"

namespace lensforge {

struct HeightFront;

/// A height map over its rectangle in the form of a lens's spline: the same surface, with fourfold
/// end knots.
ControlNet net_of(const HeightFront& front);

/// A surface's curvature across its rim, as it runs out beyond it: at the distance t it is
/// (1 − t / length)³ times that at the rim.
struct RunOut {
  double length = 0.2;  ///< mm, > 0.

  /// Slope that a curvature of 1 at the rim adds at a distance ≥ 0 from it, mm: ∫ (1 − t/length)³.
  [[nodiscard]] double slope(double distance) const {
    const double left = std::max(1.0 - distance / length, 0.0);
    return 0.25 * length * (1.0 - left * left * left * left);
  }
  /// Height that it adds, mm²: ∫ slope.
  [[nodiscard]] double height(double distance) const {
    const double left = std::max(1.0 - distance / length, 0.0);
    const double fifth = left * left * left * left * left;
    return 0.25 * length * (distance - 0.2 * length * (1.0 - fifth));
  }
};

/// The surface to cut so that a part goes on beyond the light: a lens's surface and, around its
/// rectangle, its continuation. Tools roll over the continuation as over the lens and polish
/// averages over it, so the rim comes out like all the rest.
///
/// At the distance t from a rim, with the height z, the outward slope z_n and curvature z_nn there,
/// the continuation is z + t z_n + RunOut::height(t) z_nn: twice continuously differentiable
/// beyond a spline; z_nn is 0 beyond other surfaces, whose curvature jumps from triangle to
/// triangle anyway. At a corner the surface continued across one rim is continued across the other.
/// Facets are continued by facets with the mean slopes of those that meet at the rim. Slopes and
/// curvatures go on with at most 30 times their mean size over the rim, slopes with at most 1.
///
/// Its mesh has the surface's vertices and triangles with their numbers, then those of the
/// continuation.
/// @param reach    width of the continuation, mm, > 0.
/// @pre the mesh covers its box (height_field_fault()).
std::shared_ptr<const OpticalSurface> continued_surface(
    std::shared_ptr<const OpticalSurface> surface, double reach, const RunOut& run_out);

}  // namespace lensforge
