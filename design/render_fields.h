// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/optics/optical_setup.h"
#include "core/schema/description.h"
#include "core/surface/surface_model.h"

namespace lensforge {

/// How a surface is rendered.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;  ///< With a spectrum the picture is in colour.
};

/// Every option of a rendering. A width of the picture keeps its proportions and centre, a count of
/// pixels the proportions: set in this order.
void describe(Description& d, RenderOptions& o);

}  // namespace lensforge
