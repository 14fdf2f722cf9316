// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// A picture of a source as its shape, averaged to at most kMaxShapeSide pixels a side.
/// @throw InputError if it is all black.
SourceShape shape_of(const Image& picture);

/// The height map of `--front FILE`. @throw InputError naming the file and what is wrong with it,
/// or the option if there is none.
std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control);

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
