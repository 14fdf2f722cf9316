// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "core/text/option_field.h"

namespace lensforge {

/// How a surface is rendered.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;  ///< With a spectrum the picture is in colour.
};

/// Every option of a rendering. A width of the picture keeps its proportions and centre, a count of
/// pixels the proportions: set in the table's order.
const OptionTable<RenderOptions>& render_fields();

}  // namespace lensforge
