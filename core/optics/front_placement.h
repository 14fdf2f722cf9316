// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "core/optics/optical_setup.h"

namespace lensforge {

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
