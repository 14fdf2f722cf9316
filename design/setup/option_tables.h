// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "core/text/option_field.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// Every option of a design but the weights, in the order in which a fingerprint holds them.
const OptionTable<DesignOptions>& design_fields();

/// Light and screen. A fingerprint holds what is not the default.
const OptionTable<LightOptions>& light_fields();

/// The weights, as design_fields().
const OptionTable<ObjectiveWeights>& weight_fields();

/// How a surface is rendered.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;  ///< With a spectrum the picture is in colour.
};

/// Every option of a rendering. A width of the picture keeps its proportions and centre, a count of
/// pixels the proportions: set in the table's order.
const OptionTable<RenderOptions>& render_fields();

}  // namespace lensforge
