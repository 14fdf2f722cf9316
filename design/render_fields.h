// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/optics/dispersion.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_model.h"
#include "core/text/option_field.h"

namespace lensforge {

/// How a surface is rendered.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;
  std::vector<double> wavelengths = {};  ///< nm; a picture in colour if there are any.
  double abbe = Dispersion{}.abbe;       ///< Of the material, for the wavelengths.
};

/// Every option of a rendering. A width of the picture keeps its proportions and centre, a count of
/// pixels the proportions: set in the table's order.
const OptionTable<RenderOptions>& render_fields();

}  // namespace lensforge
