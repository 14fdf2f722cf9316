// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "cam/milled/surface_field.h"
#include "core/run_control.h"
#include "core/surface_mesh.h"

namespace lensforge {

/// Nodes along either side of a tile: a patch of them takes 30 MB.
inline constexpr std::int64_t kTileSide = 1024;

/// Cuts a grid into windows of at most side + 1 nodes a side, row by row; neighbours share their
/// rim, so that every cell between four nodes lies in one of them.
std::vector<GridWindow> cut_into_tiles(const GridWindow& grid, std::int64_t side = kTileSide);

/// Samples a grid of any size tile by tile, in order, in the memory of one, and hands every patch
/// to `visit`. Reports tiles to `control`.
/// @return false if a stop was requested before the last one.
bool for_each_tile(const SurfaceField& field, const GridWindow& grid, const Executor& executor,
                   const RunControl& control,
                   const std::function<void(const SurfacePatch&)>& visit);

/// The sampled surface as a mesh that is laid out as a grid: two triangles between four nodes.
SurfaceMesh mesh_of(const SurfacePatch& patch);

}  // namespace lensforge
