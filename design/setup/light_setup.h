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

/// The shape of a source from its picture, averaged to at most kMaxShapeSide pixels per side.
/// @throw InputError if it is all black.
SourceShape shape_of(const Image& picture);

/// Reads the height map of `--front FILE`. @throw InputError naming the file and its fault, or the
/// option if there is no such file.
std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control);

/// The optical setup that the options describe, for a working picture of `pixels`. The picture's
/// centre is the point where the light from the middle of a flat surface at height `thickness`
/// meets z = focal_length, moved by image_offset. @pre require_light().
OpticalSetup optical_setup(const DesignOptions& options, const Eigen::Vector2i& pixels);

/// The same setup with the picture's centre moved along that light to another z.
OpticalSetup at_focal_length(OpticalSetup setup, double focal_length, double thickness);

/// @throw InputError naming option, value and rule if the source is on the wrong side of the
///        surface, an option does not belong to this kind of light, or the screen is not beyond the
///        surface.
void require_light(const DesignOptions& options, const Eigen::Vector2i& pixels);

}  // namespace lensforge
