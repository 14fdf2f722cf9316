// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "core/schema/description.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// Every option of a design except light and weights, in the order in which a fingerprint stores
/// them.
void describe(Description& d, DesignOptions& o);

/// Options of light and screen. A fingerprint stores only those that differ from the default.
void describe(Description& d, LightOptions& o);

/// Options of a second picture and its screen.
void describe(Description& d, SecondOptions& o);

/// The weights, stored like a design's other options.
void describe(Description& d, ObjectiveWeights& w);

void describe(Description& d, OtherLight& o);

/// Options of a rendering.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;         ///< With a spectrum the picture is in colour.
  LightOptions light = {};    ///< Of --lamp, for put_lamp().
  std::string material = {};  ///< As typed; its meaning is in the setup.
};

/// Every option of a rendering, to be set in this order: setting the picture's width keeps its
/// proportions and centre, setting its pixels keeps the proportions.
void describe(Description& d, RenderOptions& o);

}  // namespace lensforge
