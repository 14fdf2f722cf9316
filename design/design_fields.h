// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/text/option_field.h"
#include "design/design_options.h"

namespace lensforge {

/// Every option of a design but the weights, in the order in which a fingerprint holds them.
const OptionTable<DesignOptions>& design_fields();

/// The weights, likewise.
const OptionTable<ObjectiveWeights>& weight_fields();

}  // namespace lensforge
