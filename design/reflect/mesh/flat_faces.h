// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// A mesh of which every face has an area.
struct FullFaces {
  SurfaceMesh mesh;
  std::vector<int> origin;   ///< Of every face: the face of the mesh as it came that it is part of.
  std::int64_t removed = 0;  ///< Faces that had no area.
};

/// Takes faces without area out so that the surface stays closed where it was. A face that has a
/// corner twice is dropped. Where a face's corners stand in a line, the face across its longest
/// side is divided at the corner in the middle, and its halves take the place of both.
FullFaces without_flat_faces(const SurfaceMesh& mesh);

}  // namespace lensforge::reflect
