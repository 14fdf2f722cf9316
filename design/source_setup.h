// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "design/design_options.h"

namespace lensforge {

/// A picture of a source as its shape, averaged to at most kMaxShapeSide pixels a side.
/// @throw InputError if it is all black.
SourceShape shape_of(const Image& picture);

/// How large the options' source is; @pre require_source_options().
SourceExtent source_extent(const LightOptions& light);

/// @throw InputError where angle, size and shape do not go with each other or with the source.
void require_source_options(const LightOptions& light);

/// @throw InputError with the largest source that would do, if its image is wider than half of the
///        picture, or it is so wide that its edge is on the wrong side.
void require_source_extent(const DesignOptions& options, const OpticalSetup& setup);

}  // namespace lensforge
