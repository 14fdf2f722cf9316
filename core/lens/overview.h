// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/image/image.h"
#include "core/lens/lens.h"

namespace lensforge {

/// Overview picture: the target, pictures of its size, and the surface side by side, each in the
/// orientation of the target. The surface is a relief lit from the upper left, without its broad
/// curvature and with stretched contrast, which shows creases too shallow to see otherwise.
Image draw_overview(const Lens& lens, const std::vector<Image>& pictures);

}  // namespace lensforge
