// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "core/surface/surface_mesh.h"
#include "design/energy/correspondence_term.h"
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

/// The correspondence-guided half of a round (Sun et al., section 3.4).
/// @param shapes  whether the mesh's x and y are to follow the picture first (spread_vertices(),
///                align_to_creases()); the mesh then is an even one.
/// @return nothing where transport finds nothing. @throw Interrupted
std::optional<AimedMesh> transport_step(const DesignTask& task, const LevelProblem& problem,
                                        const SurfaceMesh& mesh, bool shapes, DesignLog& log);

}  // namespace lensforge
