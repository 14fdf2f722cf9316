// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/optics/optical_setup.h"
#include "design/design_options.h"

namespace lensforge {

/// What the options say of light, surface and screen, for a working picture of so many pixels. The
/// picture's centre is where the light of a flat surface's middle, `thickness` high, meets
/// z = focal_length, moved by image_offset. @pre require_light().
OpticalSetup optical_setup(const DesignOptions& options, const Eigen::Vector2i& pixels);

/// The same with the picture's centre at another z, moved along that light.
OpticalSetup at_focal_length(OpticalSetup setup, double focal_length, double thickness);

/// @throw InputError naming option, value and rule where the source is not on its side of the
///        surface, an option of one kind of light is given for another, or the screen is not beyond
///        the surface.
void require_light(const DesignOptions& options, const Eigen::Vector2i& pixels);

}  // namespace lensforge
