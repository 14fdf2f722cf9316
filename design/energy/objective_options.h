// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_model.h"
#include "design/energy/area_barrier.h"
#include "design/energy/correspondence_term.h"
#include "design/energy/weights.h"
#include "design/spline/made_by.h"

namespace lensforge {

/// Dark parts need small facets (a facet's flux is its projected area), and a thousandth of the
/// mean still divides without loss of digits.
inline constexpr double kLeastArea = 0.001;

/// Thresholds of the area barrier for a mesh of so many triangles over the lens.
/// @param least  ε1 as a share of the mean projected triangle; ε2 is five times that.
AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles,
                                 double least = kLeastArea);

struct ObjectiveOptions {
  ObjectiveWeights weights;
  SurfaceModel model = SurfaceModel::kFacet;
  int samples = 1;                ///< Of a spline: rays a knot cell each way, ≥ 1.
  std::optional<MadeBy> made_by;  ///< Of a spline: what its surface becomes; else it is as it is.
  double nu = 1.0;                ///< ν of the Welsch function, 1/mm, > 0.
  AreaBarrier area{1e-6, 5e-6};   ///< mm²
  double surface_height = 0.0;  ///< About where the surface is, mm: its source is seen from there.
};

/// What a surface is shaped after: a picture in linear light (Sun et al., Eq. 18), or where
/// transport wants the light of each face (Eq. 20).
using DesignGoal = std::variant<Image, Correspondence>;

struct ObjectiveEvaluation {
  bool feasible = false;  ///< False where a barrier is infinite; nothing else is set then.
  EnergyValues energy;
  double mae = 0.0;  ///< Mean |g − g̃|, display-encoded, not clipped; 0 for a correspondence.
};

}  // namespace lensforge
