// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/optics/outline.h"
#include "core/surface/outline_index.h"
#include "core/surface/sampled_surface.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// How an outline cuts the triangles of a mesh, seen along z.
struct MeshCut {
  struct Piece {
    std::int64_t face = -1;
    TrianglePiece piece;
  };

  static constexpr std::int32_t kWhole = -1;

  /// Of every face: kWhole inside of the outline, otherwise the number in `pieces` of its first
  /// piece. Pieces with another face from there on: nothing of it lies inside.
  std::vector<std::int32_t> first;
  std::vector<Piece> pieces;  ///< Face by face; the last belongs to no face.
  std::vector<double> share;  ///< Of every face's area that lies inside, 0 … 1.
};

/// Same answer for any number of threads. @pre every triangle faces +z.
MeshCut cut_mesh(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor);

/// The part of a surface inside of an outline as a mesh of its own. Corners on the outline take
/// height and unit normal by linear interpolation, so that facets stay in their planes.
/// @param normals  3 × V, of any length but 0.
SampledSurface part_inside(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                           const MeshCut& cut);

}  // namespace lensforge
