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

/// The cut of a mesh's triangles by an outline, seen along z.
struct MeshCut {
  struct Piece {
    std::int64_t face = -1;
    TrianglePiece piece;
  };

  static constexpr std::int32_t kWhole = -1;

  /// Per face: kWhole if inside the outline, otherwise the index in `pieces` of its first piece. If
  /// that piece belongs to another face, nothing of this face is inside.
  std::vector<std::int32_t> first;
  std::vector<Piece> pieces;  ///< Face by face; the last belongs to no face.
  std::vector<double> share;  ///< Share of each face's area that is inside, 0 … 1.
};

/// The result does not depend on the number of threads. @pre every triangle faces +z.
MeshCut cut_mesh(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor);

/// The part of a surface inside an outline as a separate mesh. Height and unit normal of corners on
/// the outline are interpolated linearly, so facets stay in their planes.
/// @param normals  3 × V, of any length but 0.
SampledSurface part_inside(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                           const MeshCut& cut);

}  // namespace lensforge
