// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "core/text/option_field.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// Every option of a design except the weights, in the order in which a fingerprint stores them.
const OptionTable<DesignOptions>& design_fields();

/// Options of light and screen. A fingerprint stores only those that differ from the default.
const OptionTable<LightOptions>& light_fields();

/// The weights, stored like design_fields().
const OptionTable<ObjectiveWeights>& weight_fields();

/// Options of a rendering.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;  ///< With a spectrum the picture is in colour.
};

/// Every option of a rendering, to be set in the table's order: setting the picture's width keeps
/// its proportions and centre, setting its pixels keeps the proportions.
const OptionTable<RenderOptions>& render_fields();

}  // namespace lensforge
