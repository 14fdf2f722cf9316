// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// Moves vertices onto the creases of a transport map, x and y alone, so that edges run along them.
///
/// A facet that lies across a crease can serve neither side: its slope is between theirs, and it
/// sends its light into the black that the crease is there for. Optimisation can only shrink it,
/// for within black nothing tells it where light would be welcome. Vertices that lie within 0.6 of
/// their shortest edge of a crease move onto it, the nearest first, as long as no triangle around
/// them loses more than nine tenths of its area. Border vertices stay. (128² logo, facet MAE after
/// 200 iterations: 0.0033 without, 0.0006 with.)
/// @param map  of the light of a flat surface through the mesh's vertices.
/// @return how many vertices were moved.
int align_to_creases(const BrenierMap& map, const OpticalSetup& setup, SurfaceMesh& mesh);

}  // namespace lensforge
