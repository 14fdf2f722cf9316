// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/schema/description.h"
#include "design/design_options.h"

namespace lensforge {

/// Every option of a design but light and weights, in the order in which a fingerprint holds them.
void describe(Description& d, DesignOptions& o);

/// Light and screen. A fingerprint holds what is not the default.
void describe(Description& d, LightOptions& o);

/// The weights, as a design's other options.
void describe(Description& d, ObjectiveWeights& w);

}  // namespace lensforge
