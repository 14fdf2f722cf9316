// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "core/surface/surface_mesh.h"
#include "design/energy/picture_terms.h"
#include "design/schedule/design_log.h"
#include "design/schedule/design_task.h"

namespace lensforge {

/// Faces at most of the even mesh whose transport shapes the mesh: a finer one is not worth it. On
/// the 512² logo, 942,080 sites were not done after 11 processor minutes, 235,520 in 80 s at most.
inline constexpr double kMaxEvenFaces = 250'000.0;

/// A mesh that sends its light to where transport wants it, as nearly as its heights can.
struct AimedMesh {
  SurfaceMesh mesh;
  Correspondence wanted;
};

/// What becomes of a mesh's x and y before its light is given places.
enum class MeshShaping {
  kNone,     ///< They stay, and the light is where the surface sends it.
  kCreases,  ///< The mesh follows the picture already; align_to_creases(), and heights begin flat.
  kSpread    ///< The mesh is even; spread_vertices() first, then as kCreases.
};

/// The correspondence-guided half of a round (Sun et al., section 3.4).
/// @return nothing where transport finds nothing. @throw Interrupted
std::optional<AimedMesh> transport_step(const DesignTask& task, const LevelProblem& problem,
                                        const SurfaceMesh& mesh, MeshShaping shaping,
                                        DesignLog& log);

}  // namespace lensforge
