// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/cam_options.h"
#include "core/text/option_field.h"

namespace lensforge {

/// Every option of a cut. Numbers that a workshop file states are the workshop's, with its limits.
const OptionTable<CamOptions>& cam_fields();

}  // namespace lensforge
