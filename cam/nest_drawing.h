// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cam/nest_job.h"

namespace lensforge {

/// The blank seen from above as SVG: lenses with their names and places, the cut around them,
/// clamps, the program's zero. One unit is a millimetre.
std::string nest_svg(const NestLayout& layout);

}  // namespace lensforge
