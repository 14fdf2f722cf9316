// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/text/option_field.h"
#include "design/design_options.h"

namespace lensforge {

/// Every option of a design but the weights, in the order in which a fingerprint holds them.
const OptionTable<DesignOptions>& design_fields();

/// Light and screen. A fingerprint holds what is not the default.
const OptionTable<LightOptions>& light_fields();

/// The weights, as design_fields().
const OptionTable<ObjectiveWeights>& weight_fields();

}  // namespace lensforge
