// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image/image.h"
#include "core/surface/lens.h"

namespace lensforge::app {

/// One picture for people: the target, the projected picture, that of the part as it is made where
/// a design knows it, and the surface side by side, each in the orientation of the target. The
/// surface is shown as a relief lit from the upper left, its broad swells flattened and its
/// contrast stretched, so that creases far too shallow to see stand out.
/// @param made  in the pixels of the lens's render; may be null.
Image draw_overview(const Lens& lens, const Image* made);

/// The relief alone, `columns` × `rows`, linear light.
Image draw_relief(const SurfaceMesh& mesh, const OpticalSetup& setup, int columns, int rows);

}  // namespace lensforge::app
