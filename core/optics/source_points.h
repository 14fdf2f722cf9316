// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// A point of an extended source.
struct SourcePoint {
  Eigen::Vector2d at;  ///< Offset right and up from the middle, seen from the lens: rad or mm.
  double share;        ///< Share of the source's light.
};

/// Points distributed over a source, with shares that sum to 1. A disc has `count` points of equal
/// shares along Vogel's spiral (1979), of which every other point is spread as evenly. A shape has
/// the centres of its lit pixels, each subdivided so that there are about `count` in all, at least
/// one per pixel. A source without extent is one point. @pre count ≥ 1.
std::vector<SourcePoint> source_points(const SourceExtent& extent, int count);

/// The light of one point of the source alone: parallel light turned by `at`, or light from a point
/// moved by `at` across the line to the middle of the lens.
OpticalSetup lit_from(OpticalSetup setup, const Eigen::Vector2d& at);

/// Jacobian J of the landing point by the source point, pixels per rad or mm: u = u₀ + J·at, for
/// light that goes from the middle of the lens at height z to the picture's centre. A central
/// difference over the source's width. For a thin lens along z it is −f per rad or −(f / D) per mm,
/// times the pixels per mm. A tilted screen has two scales.
Eigen::Matrix2d source_motion(const OpticalSetup& setup, double z);

/// Width of the source's image on the screen along its widest direction, pixels.
double source_blur(const OpticalSetup& setup, double z);

}  // namespace lensforge
