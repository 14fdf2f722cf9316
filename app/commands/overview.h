// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image/image.h"
#include "core/lens/lens.h"
#include "design/design.h"

namespace lensforge::app {

/// Overview picture: the target, the projected picture, that by waves or of the part as made (if
/// known), and the surface side by side, each in the orientation of the target. The surface is
/// a relief lit from the upper left, without its broad curvature and with stretched contrast, which
/// shows creases too shallow to see otherwise.
Image draw_overview(const DesignResult& result);

/// The relief alone, `columns` × `rows`, linear light.
Image draw_relief(const SurfaceMesh& mesh, const OpticalSetup& setup, int columns, int rows);

}  // namespace lensforge::app
