// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// A point of an extended source.
struct SourcePoint {
  Eigen::Vector2d at;  ///< Right and up from its middle, as seen from the lens: rad, or mm.
  double share;        ///< Of its light.
};

/// Points all over a source, with shares that sum to 1: on a disc `count` of equal shares along
/// Vogel's spiral (1979), whose every other point is spread as evenly; of a shape the middles of
/// its lit pixels, each divided as often as makes about `count` in all, but at least once. A source
/// without extent is one point. @pre count ≥ 1.
std::vector<SourcePoint> source_points(const SourceExtent& extent, int count);

/// The light of one point of the source alone: parallel light from a direction turned by `at`, or
/// light from a point moved across the line to the middle of the lens.
OpticalSetup lit_from(OpticalSetup setup, const Eigen::Vector2d& at);

/// How a move over the source moves the light on the screen, pixels per rad or mm: u = u₀ + J·at,
/// for the light of the middle of the lens at height z that goes to the picture's centre. A central
/// difference over the source's width. Through a thin lens along z it is −f per rad and −(f / D)
/// per mm times the pixels per mm. On a tilted screen it has two scales.
Eigen::Matrix2d source_motion(const OpticalSetup& setup, double z);

/// Width of the source's image on the screen, pixels: along the direction in which it is widest.
double source_blur(const OpticalSetup& setup, double z);

}  // namespace lensforge
