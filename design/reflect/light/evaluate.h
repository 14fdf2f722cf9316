// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/directions.h"
#include "design/reflect/light/goal.h"

namespace lensforge::reflect {

/// Reflected energy ½ Σ a_k ⟨L² V⟩·5 of a shape: by one reflection alone, and by one and two.
struct Energies {
  double direct = 0.0;
  double total = 0.0;
};

/// Light paths of meshes with fewer faces than this are asked on a finer mesh of the same surface,
/// so that shadows need not follow its faces.
inline constexpr std::int64_t kEvaluatedFaces = 4096;

/// The energies with the normals of the mesh's own faces, always of the square of the radiance.
/// @throw Interrupted
Energies evaluate(const SurfaceMesh& mesh, const Goal& goal, const DirectionSet& directions,
                  const Executor& executor);

}  // namespace lensforge::reflect
