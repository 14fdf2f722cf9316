// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/mpi/parcel.h"
#include "design/mpi/ranks.h"

namespace lensforge {

/// What a GuidedStage is made of; see GuidedStageOn.
struct StageProblem {
  SurfaceMesh mesh;
  OpticalSetup setup;
  double aspect = 1.0;
  DesignGoal goal;
  ObjectiveOptions options;
};

/// A setup there and back, every bit of it.
void put_setup(const OpticalSetup& setup, Parcel& parcel);
OpticalSetup take_setup(Parcel& parcel);

/// Rank 0's problem in the part that this rank holds: its mesh is that of its RowSlab, a
/// correspondence that of the faces there. Collective. @param whole  of rank 0; null elsewhere.
/// @pre RowSlab::suffices() and has_row_order() of the mesh, and no spline.
/// @param grid  receives the whole mesh's.
StageProblem share_problem(const StageProblem* whole, const Ranks& ranks, GridShape& grid);

}  // namespace lensforge
