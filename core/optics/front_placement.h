// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// A front for a lens of this size: its apex is in the middle, and its highest point over the lens
/// lies in z = 0. @pre |radius| is longer than half of the lens's diagonal.
SphericalFront spherical_front(double radius, const Eigen::Vector2d& lens_size);

/// True if the part itself stands between the source and a place of its front. Sampled: a shadow
/// narrower than a hundredth of the way may be missed. @pre the front covers the place.
bool is_shadowed(const OpticalSetup& setup, const Eigen::Vector2d& place);

/// How far beyond the lens's edges light enters the front that comes to a point of the surface, mm;
/// 0 where it enters within them.
double overhang(const OpticalSetup& setup, const Eigen::Vector3d& p);

/// How far over the screen the light of a surface point is moved, mm, if the front lies 1 mm aside:
/// the mean of x and y. @pre setup.front.
double shift_by_front(const OpticalSetup& setup, const Eigen::Vector3d& p);

/// Lowest point of a front over a rectangle, mm; of a height map the lowest one of four places a
/// sample's distance each way. @pre the front covers it.
double lowest_of(const Front& front, const Eigen::AlignedBox2d& rectangle);

/// What is wrong with the light behind a front, somewhere over the lens.
enum class FrontFault {
  kUnlit,  ///< It comes from the other side, or goes down inside.
  kFolds,  ///< Neighbouring rays meet below a height.
};

/// Behind a height map, at every sample and half-way between them; nothing if its light comes to
/// the height z unfolded. @pre setup.front is one.
std::optional<FrontFault> height_map_fault(const OpticalSetup& setup, double z);

}  // namespace lensforge
